"""`twip report`: make an HTML file of a log: the moving robot, plots, metrics."""

import argparse
from pathlib import Path

from ..errors import TwipError
from ..lab.metrics import is_robot, measure
from ..lab.report import ENDINGS, report, sweep_report
from .parts.logs import extent, read_log
from .parts.paths import beside, made_from
from .parts.terminal import print_json, print_rows

DESCRIPTION = """\
examples:
  twip report logs/twip.mcap
  twip report logs/twip.mcap logs/pid.mcap --out compared.html
  twip report logs/bench.mcap --signals 'motor.*'
  twip report logs/sweep.parquet

Make an HTML file of a log that opens in any browser, offline: the robot from the side and from above, moving,
plots that follow it, metrics, parameters and origin. Several logs are laid over each other and compared.
The results of a sweep give a report of their own: success rates, maps, ranking, metrics, failed runs."""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.description = DESCRIPTION
    parser.add_argument(
        "logs",
        nargs="+",
        type=Path,
        metavar="LOG.mcap or SWEEP.parquet",
        help="logs of twip, or the results of one sweep",
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="FILE.html",
        help="default: beside the first log, LOG.html, of a sweep SWEEP-sweep.html",
    )
    parser.add_argument(
        "--signals",
        nargs="+",
        action="extend",
        default=[],
        metavar="NAME",
        help="signals (component.variable; * and ? stand for any text and letter) to plot besides the usual ones, "
        "in the log's units; default: none",
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object instead of text, for scripts")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Write the report, and return the exit status."""
    sweeps = [log for log in arguments.logs if log.suffix == ".parquet"]
    usual = beside(sweeps[0], "-sweep.html") if sweeps else None
    out = made_from(arguments.logs, arguments.out or usual, ENDINGS)
    if sweeps and (len(arguments.logs) > 1 or arguments.signals):
        raise TwipError(f"{sweeps[0]}: the results of a sweep are reported alone, without logs and --signals")
    if sweeps:
        sweep_report(sweeps[0], out)
        if arguments.json:
            print_json({"report": out, "bytes": out.stat().st_size})
        else:
            print_rows(("report", out), ("size", f"{out.stat().st_size / 1e6:.1f} MB"))
        return 0
    logs = [read_log(log) for log in arguments.logs]
    report(logs, out, arguments.signals)
    if arguments.json:
        metrics = {str(log.path): measure(log) if is_robot(list(log.signals)) else None for log in logs}
        extents = {str(log.path): extent(log) for log in logs}
        print_json({"report": out, "bytes": out.stat().st_size, "logs": extents, "metrics": metrics})
        return 0
    print_rows(("report", out), ("size", f"{out.stat().st_size / 1e6:.1f} MB"))
    return 0
