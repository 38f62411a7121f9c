"""`twip build`: build the FMUs and SSPs."""

import argparse
from pathlib import Path

from ..cosim import load
from ..fmi import FMI_VERSIONS, build_all, build_fmi3, build_native
from ..lab.container import pack
from ..lab.native_container import pack_native
from .container import default_name

ROBOT = "twip"
"""The system that also becomes one FMU."""

DESCRIPTION = """\
examples:
  twip build
  twip build motor plant --out /tmp/robot
  twip build --fmi 3
  twip build --native

Build the blocks' FMUs, the wired systems' SSPs and the whole robot as one FMU (fmus/twip.fmu in FMI 2.0,
fmus/twip_fmi3.fmu in FMI 3.0), and print their paths; with --fmi 3 the blocks alone, in FMI 3.0, as
fmus/<block>_fmi3.fmu. With --native the FMUs hold C and libraries for Linux, Windows and macOS in place of Python
(docs/native.md): fmus/<block>_native.fmu and ssp/<system>_native.ssp, with --fmi 3 fmus/<block>_native_fmi3.fmu."""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.description = DESCRIPTION
    parser.add_argument("blocks", nargs="*", help="names of blocks; default: all blocks and systems")
    parser.add_argument(
        "--out",
        type=Path,
        default=Path(),
        metavar="DIR",
        help="where fmus/ and ssp/ are written; default: the current folder",
    )
    parser.add_argument(
        "--fmi", choices=[v[0] for v in FMI_VERSIONS], default="2", help="major version of FMI; default: 2"
    )
    parser.add_argument(
        "--native", action="store_true", help="FMUs without Python, by a C compiler (extra `native`, else cc)"
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Build, and return the exit status."""
    if arguments.native:
        version = next(v for v in FMI_VERSIONS if v.startswith(arguments.fmi))
        built = build_native(arguments.out, arguments.blocks or None, print, version)
        for path in built_containers(arguments.out, built, f"{ROBOT}_native"):
            print(path)
        return 0
    if arguments.fmi == "3":
        build_fmi3(arguments.out, arguments.blocks or None, print)
        return 0
    built = build_all(arguments.out, arguments.blocks or None, print)
    for path in built_containers(arguments.out, built):
        print(path)
    return 0


def built_containers(output: Path, built: list[Path], name: str = ROBOT) -> list[Path]:
    """Build the whole robot as one FMU in each version of FMI if its SSP is among what is `built`; return the paths."""
    paths = [output / "fmus" / default_name(name, version) for version in FMI_VERSIONS]
    if output / "ssp" / f"{name}.ssp" not in built:
        return []
    with load(output / "ssp" / f"{name}.ssp") as system:
        for version, path in zip(FMI_VERSIONS, paths, strict=True):
            (pack if name == ROBOT else pack_native)(system, version, path)
    return paths
