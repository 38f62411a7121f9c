"""`twip container`: pack a system of FMUs into one FMU."""

import argparse
import sys
from pathlib import Path

from ..cosim import load
from ..fmi import FMI_VERSIONS
from ..lab.container import pack
from ..lab.endings import check_ending
from ..lab.native_container import pack_native
from .parts.build_hint import told_to_build
from .parts.experiment import declare_values, pairs
from .parts.paths import refuse_clashes
from .parts.terminal import print_rows

DESCRIPTION = """\
examples:
  twip container ssp/twip.ssp
  twip container ssp/twip.ssp --fmi 3 --output-file robot.fmu
  twip container ssp/twip_native.ssp --native
  twip container ssp/twip.ssp --parameters ssp/parameters/pid.ssv --start-values plant.pitch_start 0.3

Pack a system of FMUs into one FMU that any FMI tool can run. Outputs, open inputs and parameters are named
component.variable. What the container does otherwise than the system is told; what it cannot do is an error. With
--native the FMUs must be native (twip build --native, docs/native.md): the container then holds C and no Python, and
keeps the system's coupling."""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.description = DESCRIPTION
    parser.add_argument("ssp", help=".ssp archive, unpacked folder or .ssd file")
    parser.add_argument(
        "--fmi", choices=[v[0] for v in FMI_VERSIONS], default="2", help="major version of FMI; default: 2"
    )
    parser.add_argument(
        "--output-file", type=Path, metavar="FILE.fmu", help="default: <system>.fmu, with --fmi 3 <system>_fmi3.fmu"
    )
    parser.add_argument(
        "--step-size",
        type=float,
        metavar="S",
        help="step of the inside in s; default: the system's, else the smallest of its FMUs",
    )
    parser.add_argument("--native", action="store_true", help="join the C sources of native FMUs, without Python")
    declare_values(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Pack the system, and return the exit status."""
    version = next(v for v in FMI_VERSIONS if v.startswith(arguments.fmi))
    output = arguments.output_file or Path(default_name(Path(arguments.ssp).stem, version))
    reads = [("SSP", arguments.ssp), *(("--parameters", p) for p in arguments.parameters)]
    check_ending(output, [".fmu"])
    refuse_clashes(reads, {"--output-file": output})
    values = pairs(arguments.start_values)
    with (
        told_to_build(arguments.ssp),
        load(arguments.ssp, parameters=arguments.parameters, start_values=values) as system,
    ):
        differences = (pack_native if arguments.native else pack)(system, version, output, arguments.step_size)
        for difference in differences:
            print(f"twip: warning: not as in the system: {difference}", file=sys.stderr)
    print_rows(("container", output))
    return 0


def default_name(system: str, version: str) -> str:
    """Return the name of a system's container in an FMI version."""
    return f"{system}.fmu" if version == "2.0" else f"{system}_fmi3.fmu"
