"""The numbers of docs/coupling.md that are measured on a closed form."""

from pathlib import Path

from coupling_orders import markdown, ring

PAGE = Path(__file__).parents[2] / "docs" / "coupling.md"


def test_the_page_has_what_is_measured(fmus, tmp_path):
    page = PAGE.read_text(encoding="utf-8")
    found = page.partition("<!-- orders: begin -->\n\n")[2].partition("\n\n<!-- orders: end -->")[0]
    assert found == markdown(ring(fmus, tmp_path))  # `python benchmarks/coupling.py --orders` writes it
