"""What the table of claims says of a measurement."""

import json

import pytest

from twip.errors import TwipError
from twip.lab.paper.checks import Check, Result, interval, number
from twip.lab.paper.programme import FIGURES, GROUPS, Timed, chosen
from twip.lab.paper.reports import markdown, missed, write_reports


def check(measured, **more):
    return Check("Fig 1", "it holds", "a | b", measured, 1.0, 2.0, "°", "theory", **more)


def test_an_expectation_is_met_by_every_seed_or_not_at_all():
    assert check([1.0, 1.5, 2.0]).met
    assert not check([1.5, 2.01]).met
    assert not check([]).met
    assert not check([float("nan")]).met
    assert not check([float("inf")]).met


def test_what_was_expected_and_what_the_paper_claims_are_two_questions():
    shown = check([1.5], holds=False, only="not at all")
    assert shown.met
    assert shown.holds_text == "no: not at all"
    assert check([1.5], holds=True).holds_text == "yes"
    assert check([1.5], holds=True, only="for k = 10 1/s").holds_text == "only for k = 10 1/s"
    assert check([1.5]).holds_text == "–"


def test_a_measurement_shows_mean_extremes_and_seeds():
    assert check([1.0, 1.5, 2.0]).measured_text == "1.5° (1 … 2, 3 seeds)"
    assert check([1.0]).measured_text == "1°"


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0"), (0.0064, "0.006"), (0.513, "0.51"), (25.93, "25.9"), (383.0, "383"), (1e-6, "1e-06")],
)
def test_numbers_have_the_digits_that_matter(value, text):
    assert number(value) == text


def test_intervals_are_inequalities_where_one_end_is_open():
    assert interval(1.0, 2.0, "V") == "1 … 2 V"
    assert interval(2.0, 2.0, "of 2") == "2 of 2"
    assert interval(1.0, float("inf"), "s") == "≥ 1 s"
    assert interval(float("-inf"), 1.0, "°") == "≤ 1°"


def test_the_page_has_a_row_per_check_and_names_what_is_missed(tmp_path):
    results = [Timed(Result("fig01", "A title", (check([1.5]), check([3.0])), ("twip run x",)), 1.0)]
    assert missed(results) == [results[0].result.checks[1]]
    page = markdown(results)
    rows = [line for line in page.splitlines() if line.startswith("| it holds")]
    assert len(rows) == 2
    assert {row.count("|") for row in rows} == {9}  # eight cells: the bar in a cell's text does not split it
    assert ["**missed**" in row for row in rows] == [False, True]
    assert "1 of 2 values are as expected" in page
    assert "    twip run x" in page
    written, numbers = write_reports(results, tmp_path)
    assert written.read_text(encoding="utf-8") == page
    found = json.loads(numbers.read_text(encoding="utf-8"))
    assert [c["met"] for c in found[0]["checks"]] == [True, False]
    assert found[0]["checks"][1]["measured"] == [3.0]


def test_figures_are_chosen_by_name_and_kept_in_the_papers_order():
    assert chosen([]) == list(FIGURES)
    assert chosen(["fig14", "fig07"]) == ["fig07", "fig14"]
    assert chosen(["table4", "table3", "fig19"]) == ["fig03", "fig19"]
    with pytest.raises(TwipError, match="no experiment fig99; there are fig02"):
        chosen(["fig07", "fig99"])


def test_every_figure_is_in_one_group():
    assert sorted(name for group in GROUPS for name in group) == sorted(FIGURES)
