"""The native FMU of one block: description, sources, and a library for each platform."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path

from lxml import etree

from ...errors import TwipError
from ...platform import PLATFORMS, Platform
from ..archive import write_archive
from ..blocks import load_block
from ..declare import Block
from ..description import Origin, model_description
from ..icon import icon_files
from ..interface import Capabilities, Interface, interface_of
from ..origin import licence, origin_of
from ..page import documentation_page
from ..rules import broken_declarations
from ..sources import fingerprint, guid
from ..table import Table
from .block_source import FREESTANDING, LAYERS, block_source, identity_source, runtime_sources
from .toolchain import FLAGS, libraries

CAPABILITIES = Capabilities(needs_execution_tool=False, host_memory=True)


@dataclass(frozen=True)
class Model:
    """What a native FMU computes."""

    symbol: str
    """Name of the model in C (`twip_Model` in c/twip_model.h)."""
    sources: Mapping[str, bytes]
    """C files by name, besides those that all native FMUs share."""


def package_native(face: Path, output: Path, version: str, platforms: Sequence[Platform] = PLATFORMS) -> None:
    """Write the native FMU of the block declared in `face` to `output` in FMI `version`, for `platforms`.

    The same block gives the same bytes. A block that breaks a rule raises TwipError with a line per problem.
    """
    block = load_block(face)
    problems = broken_declarations(block)
    if problems:
        raise TwipError(problems)
    _try_a_step(block)
    sources = {f"{block.name}.c": block_source(block).encode()}
    interface = replace(interface_of(block), capabilities=CAPABILITIES, native=False)
    readme = face.with_name("README.md")
    page = readme.read_text(encoding="utf-8") if readme.is_file() else ""
    extra = icon_files(face, version)
    model = Model(f"{block.name}_model", sources)
    write_native(interface, model, page, version, output, origin_of(licence()), extra, platforms)


def write_native(
    interface: Interface,
    model: Model,
    readme: str,
    version: str,
    output: Path,
    origin: Origin,
    extra: Mapping[str, bytes],
    platforms: Sequence[Platform],
) -> None:
    """Write a native FMU.

    `readme` is its page in Markdown; `extra` holds further files of the archive.
    """
    listed = sorted(f for f in (*model.sources, LAYERS[version]) if f.endswith(".c"))
    interface = replace(interface, sources=tuple(listed))
    complete = {**runtime_sources(version), **model.sources}
    digest = fingerprint(complete, model_description(interface, version, "", origin))
    token = guid(digest)
    complete["identity.h"] = identity_source(interface.identifier, model.symbol, token).encode()
    files = dict(extra)
    files["modelDescription.xml"] = model_description(interface, version, token, origin)
    files["documentation/index.html"] = documentation_page(interface, version, readme, token, origin)
    files.setdefault("documentation/licenses/twip.txt", licence().encode())
    files.setdefault("documentation/licenses/license.txt", b"All of this FMU is under the terms in twip.txt\n")
    files |= {f"sources/{name}": content for name, content in complete.items() if name != FREESTANDING}
    if version == "3.0":
        files["sources/buildDescription.xml"] = build_description(interface)
    files |= libraries(interface.identifier, complete, version, platforms)
    write_archive(output, files, first="modelDescription.xml")


def build_description(interface: Interface) -> bytes:
    """Return what FMI 3.0 says of building the sources (FMI 3.0.1, section 2.5)."""
    root = etree.Element("fmiBuildDescription", {"fmiVersion": "3.0"})
    configuration = etree.SubElement(root, "BuildConfiguration", {"modelIdentifier": interface.identifier})
    options = " ".join(f for f in FLAGS if f in ("-ffp-contract=off", "-fno-math-errno", "-fwrapv"))
    files = etree.SubElement(configuration, "SourceFileSet", {"language": "C99", "compilerOptions": options})
    for name in interface.sources:
        etree.SubElement(files, "SourceFile", {"name": name})
    etree.indent(root)
    xml: bytes = etree.tostring(root, xml_declaration=True, encoding="UTF-8")
    return xml + b"\n"


def _try_a_step(block: Block) -> None:
    """Do one step in Python from the start values, so that a slip in the block shows here and not in a simulation."""
    table = Table(block)
    values = table.start_values(table.slots())
    where = f"block {block.name} with its start values"
    try:
        problems = table.broken_rules(values)
        if not problems:
            table.clear(values)
            block.initialize(values, 0.0)
            block.step(values, 0.0, block.step_size)
    except Exception as error:
        raise TwipError(f"{where}: {type(error).__name__}: {error}") from error
    wrong = [v.name for v in table.outputs if not problems and not isfinite(getattr(values, v.attribute))]
    problems += [f"{name} after a step must be finite" for name in wrong]
    if problems:
        raise TwipError(f"{where}: {p}" for p in problems)
