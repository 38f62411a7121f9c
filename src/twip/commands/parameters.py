"""`twip parameters`: list a system's parameters."""

import argparse
from pathlib import Path

from ..cosim import load, parameters_of, write_parameter_set
from .parts.build_hint import told_to_build
from .parts.paths import refuse_clashes
from .parts.terminal import print_rows

DESCRIPTION = """\
examples:
  twip parameters ssp/twip.ssp
  twip parameters ssp/twip.ssp --output-file heavier.ssv

List every parameter of a system's components with the value it starts with, or write them as a parameter set that
`twip run --parameters` takes."""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.description = DESCRIPTION
    parser.add_argument("ssp", help=".ssp archive, unpacked folder or .ssd file")
    parser.add_argument(
        "--ssd", metavar="NAME", help="one of several descriptions in the archive; default: SystemStructure.ssd"
    )
    parser.add_argument("--output-file", type=Path, metavar="FILE.ssv", help="write a parameter set; default: print")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """List or write the parameters, and return the exit status."""
    refuse_clashes([("SSP", arguments.ssp)], {"--output-file": arguments.output_file})
    with told_to_build(arguments.ssp), load(arguments.ssp, ssd=arguments.ssd) as system:
        entries = parameters_of(system)
    if arguments.output_file is None:
        for entry in entries:
            value = str(entry.value).lower() if isinstance(entry.value, bool) else entry.value
            print(f"{entry.name:<40} {value}{f' {entry.unit.name}' if entry.unit else ''}")
    else:
        write_parameter_set(arguments.output_file, arguments.output_file.stem, entries)
        print_rows(("parameters", len(entries)), ("parameter set", arguments.output_file))
    return 0
