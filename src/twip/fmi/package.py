"""Builds the FMU of one block in this process: `python -m twip.fmi.package FACE.py OUTPUT.fmu FMI_VERSION`.

A process of its own for each block, because pythonfmu imports what it packs.
"""

import importlib
import importlib.metadata
import logging
import sys
import tempfile
import zipfile
from pathlib import Path
from typing import Any

import pythonfmu
import pythonfmu3

from ..errors import TwipError
from .archive import write_archive
from .blocks import load_block
from .build import REFUSED
from .declare import Block
from .description import model_description
from .icon import icon_files
from .interface import interface_of
from .origin import licence, licence_of, origin_of
from .page import documentation_page
from .rules import broken_declarations
from .sources import carried_sources, fingerprint, guid, slave_sources

TOOLS = {"2.0": pythonfmu, "3.0": pythonfmu3}
"""What makes an FMU of Python code, by version of FMI."""

UNNEEDED = {
    f"resources/{t.__name__}/{name}.py" for t in TOOLS.values() for name in ("csvbuilder", "deploy", "__main__")
}
"""Files of theirs that no FMU runs."""


def package_block(face: Path, output: Path, version: str) -> None:
    """Write the FMU of the block declared in `face` to `output` in FMI `version`.

    A block that breaks a rule raises TwipError.
    """
    block = load_block(face)
    problems = broken_declarations(block)
    if problems:
        raise TwipError(problems)
    terms = licence()
    tool = TOOLS[version].__name__
    origin = origin_of(terms, tool)
    interface = interface_of(block)
    sources = carried_sources(face, version)
    digest = fingerprint(sources, model_description(interface, version, "", origin))
    module, code = slave_sources(block, version, sources, digest)
    readme = face.with_name("README.md")
    files = packed(block.name, TOOLS[version].FmuBuilder, module, code)
    _try_a_step(block, module)
    files["modelDescription.xml"] = model_description(interface, version, guid(digest), origin)
    text = readme.read_text(encoding="utf-8") if readme.is_file() else ""
    files["documentation/index.html"] = documentation_page(interface, version, text, guid(digest), origin)
    files |= {f"documentation/licenses/{name}": content for name, content in licences(terms, tool).items()}
    files |= icon_files(face, version)
    write_archive(output, files, first="modelDescription.xml")


def packed(name: str, builder: Any, module: str, code: dict[str, bytes]) -> dict[str, bytes]:
    """Let the builder of pythonfmu or pythonfmu3 build the FMU of the code (path → content).

    Returns what it packed, without what is not needed.
    """
    with tempfile.TemporaryDirectory(prefix="twip_build_") as folder:
        stage = Path(folder) / "stage"
        for path_in_fmu, content in code.items():
            path = stage / path_in_fmu
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        package = next(p.split("/")[0] for p in code if "/" in p)
        (Path(folder) / "fmu").mkdir()
        builder.build_FMU(stage / f"{module}.py", Path(folder) / "fmu", [stage / package])
        with zipfile.ZipFile(Path(folder) / "fmu" / f"{name}.fmu") as archive:
            names = (n for n in archive.namelist() if n not in UNNEEDED and not n.startswith("sources/"))
            return {n: archive.read(n) for n in names if not n.endswith("/")}


def _try_a_step(block: Block, module: str) -> None:
    """Initialize the packed block and do one step, so that a slip in it shows here and not in a simulation."""
    package = module.replace("twip_slave_", "_twip_")
    model = importlib.import_module(f"{package}.model")
    slave = next(v for v in vars(model).values() if isinstance(v, type) and v.__module__ == model.__name__)
    instance = slave(instance_name=block.name)
    instance.setup_experiment(0.0)
    instance.enter_initialization_mode()
    instance.exit_initialization_mode()
    if not instance.do_step(0.0, block.step_size):
        messages = [m.msg.replace("%%", "%") for m in instance.log_queue]
        raise TwipError(f"block {block.name} with its start values: {m}" for m in messages)


def licences(terms: str, tool: str) -> dict[str, bytes]:
    """Return the texts that an FMU made with `tool` carries."""
    overview = (
        "This FMU holds\n\n"
        "- the block's own code (resources/_twip_*): see twip.txt\n"
        f"- {tool} {importlib.metadata.version(tool)} (binaries, resources/{tool}): see {tool}.txt\n"
    )
    return {
        "license.txt": overview.encode(),
        "twip.txt": terms.encode(),
        f"{tool}.txt": licence_of(tool),
    }


def main(arguments: list[str]) -> int:
    """Build one FMU; print what is wrong to the standard error and return `REFUSED` when it cannot be built."""
    logging.disable()
    try:
        package_block(Path(arguments[0]), Path(arguments[1]), arguments[2])
    except TwipError as error:
        print(error, file=sys.stderr)
        return REFUSED
    except OSError as error:
        print(f"{error.filename or arguments[1]}: cannot be written: {error.strerror}", file=sys.stderr)
        return REFUSED
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
