"""Measures how far the co-simulated robot is from the monolithic reference, for every coupling and step, and how far
couplings are from a closed form.

    python benchmarks/coupling.py                 build the FMUs in a temporary folder, measure, write table and picture
    python benchmarks/coupling.py --built DIR     use the FMUs that `twip build --out DIR` has built
    python benchmarks/coupling.py --stored        measure nothing: draw what was measured last
    python benchmarks/coupling.py --orders        measure on the closed form alone: ten seconds

Takes about four minutes. Writes tests/reference/coupling_error.csv, docs/coupling.png and the tables in
docs/coupling.md.
"""

import argparse
import csv
import sys
import tempfile
from pathlib import Path

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from pythonfmu.builder import FmuBuilder

from twip.fmi.build import build_all

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "tests" / folder) for folder in ("reference", "robot", "cosim")]
import coupling_orders  # noqa: E402
from coupling_error import DEFAULT, INNER, SCHEMES, STEPS, STORED, markdown, stored, sweep, true_state_robot  # noqa: E402

PAGE, PICTURE = ROOT / "docs" / "coupling.md", ROOT / "docs" / "coupling.png"
SLAVE = ROOT / "tests" / "cosim" / "slaves" / "cosim_integrator.py"
DRAWN = ("stand-up with a turn", "stick–slip standing", "rolling")
STYLES = {
    "Jacobi": {"color": "#d55e00", "marker": "s"},
    "Gauss–Seidel": {"color": "#0072b2", "marker": "o"},
    DEFAULT: {"color": "#009e73", "marker": "D"},
    INNER: {"color": "#888888", "marker": ".", "linestyle": ":"},
}


def measure(built: Path | None) -> None:
    """Measure everything, print each number and store all."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if built is None:
            build_all(folder)
        rows = []
        print(f"{'scenario':<24} {'coupling':<32} {'step':>8} {'pitch error':>12}")
        for row in sweep(true_state_robot(built or folder, folder / "true_states")):
            scenario, label, step_size, error = row
            print(f"{scenario:<24} {label:<32} {1e3 * step_size:5g} ms {error:11.6f}°", flush=True)
            rows.append((scenario, label, repr(step_size), f"{error:.4g}"))
    with STORED.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("scenario", "coupling", "communication step [s]", "pitch error [deg]"))
        writer.writerows(rows)


def picture(errors: dict[tuple[str, str, float], float]) -> Figure:
    """Return error over step, a panel for each scenario."""
    figure = Figure(figsize=(11.0, 4.6), layout="constrained")
    panels = figure.subplots(1, len(DRAWN), sharex=True, sharey=True)
    milliseconds = [1e3 * h for h in STEPS]
    for axes, name in zip(panels, DRAWN, strict=True):
        for label in (*SCHEMES, INNER):
            axes.loglog(
                milliseconds, [errors[name, label, h] for h in STEPS], label=label, markersize=5, **STYLES[label]
            )
        axes.set_title(name)
        axes.set_xlabel("communication step [ms]")
        axes.grid(color="#dddddd", linewidth=0.6)
        axes.set_axisbelow(True)
    panels[0].set_ylabel("largest pitch error [°]")
    guide(panels[2], 1, 0.004, "slope 1")
    guide(panels[2], 2, 2.2e-5, "slope 2")
    # last, because every logarithmic plot resets the ticks of all panels
    for axes in panels:
        axes.set_xticks(milliseconds, [f"{x:g}" for x in milliseconds])
        axes.minorticks_off()
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
    return figure


def guide(axes: Axes, slope: int, height: float, text: str) -> None:
    """Draw a line of a slope through `height` [deg] at 0.5 ms."""
    ends = (0.25, 1.0)
    axes.loglog(ends, [height * (x / 0.5) ** slope for x in ends], color="black", linewidth=0.9, linestyle="--")
    axes.annotate(text, (ends[1], height * 2.0**slope), (4, -3), textcoords="offset points", fontsize=9)


def orders() -> str:
    """Build the FMU, and return the tables of what is measured on the closed form."""
    with tempfile.TemporaryDirectory() as name:
        FmuBuilder.build_FMU(SLAVE, dest=name)
        return coupling_orders.markdown(coupling_orders.ring(Path(name), Path(name)))


def write_page(name: str, table: str) -> None:
    """Replace the table called `name` in the page."""
    begin, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
    before, found, rest = PAGE.read_text(encoding="utf-8").partition(begin)
    _, closed, after = rest.partition(end)
    if not found or not closed:
        raise SystemExit(f"{PAGE}: the markers {begin} and {end} are missing")
    PAGE.write_text(f"{before}{begin}\n\n{table}\n\n{end}{after}", encoding="utf-8")


def main() -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--built", type=Path, metavar="DIR", help="folder with fmus/*.fmu; default: build them")
    parser.add_argument("--stored", action="store_true", help="draw what was measured last")
    parser.add_argument("--orders", action="store_true", help="measure on the closed form alone")
    arguments = parser.parse_args()
    if not arguments.stored:
        write_page("orders", orders())
    if arguments.orders:
        return 0
    if not arguments.stored:
        measure(arguments.built)
    mpl.rcParams.update({"font.size": 10.5, "axes.spines.top": False, "axes.spines.right": False})
    errors = stored()
    picture(errors).savefig(PICTURE, dpi=130, metadata={"Software": None})
    write_page("measured", markdown(errors))
    print(f"wrote {STORED.relative_to(ROOT)}, {PICTURE.relative_to(ROOT)}, {PAGE.relative_to(ROOT)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
