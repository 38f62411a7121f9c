"""Validation against the XML schemas of SSP: those of version 1 ship with fmpy, those of version 2 with the package
pyssp_standard (extra `ssp2`). Without the latter the readers' own checks stand alone for version 2.
"""

import functools
import pathlib
import re
from importlib.util import find_spec
from typing import Any

import fmpy
from lxml import etree

from ..reading.problems import Place, Problems
from ..reading.xml import Element, Reader, name_of, ssp_name

_VERSION = re.compile(r"([12])\.([0-9]+)(-.*)?")


def version_of(root: Element) -> int | None:
    """Return 1 or 2, the major version of the format of a document, None for any other."""
    match = _VERSION.fullmatch(root.get("version", "").strip())
    return None if match is None else int(match[1])


def schema_folder(version: int) -> pathlib.Path | None:
    """Return the folder with the schemas of a major version, None where the package that holds them is missing."""
    if version == 1:
        return pathlib.Path(fmpy.__file__).parent / "ssp" / "schema"
    spec = find_spec("pyssp_standard")
    for location in () if spec is None else spec.submodule_search_locations or ():
        folder = pathlib.Path(location) / "resources" / "ssp2"
        if folder.is_dir():
            return folder
    return None


@functools.cache
def _schema(folder: pathlib.Path, name: str) -> etree.XMLSchema | None:
    file = folder / f"{name}.xsd"
    return etree.XMLSchema(etree.parse(file)) if file.is_file() else None


_ROOTS = {
    "SystemStructureDescription": "SystemStructureDescription",
    "ParameterSet": "SystemStructureParameterValues",
    "ParameterMapping": "SystemStructureParameterMapping",
    "SignalDictionary": "SystemStructureSignalDictionary",
}
"""The schema of a document by the name of its outermost element."""


def opened(root: Element, name: str, file: str, problems: Problems) -> Reader | None:
    """Return a reader for a document that stands alone or inside another one, None when it is no valid `name`.

    What the document holds and nobody here uses is warned of.
    """
    reader = Reader(file, problems)
    if ssp_name(root) != name:
        found = ssp_name(root) if name_of(root) == name else name_of(root)
        problems.add(f"expected a {name}, found {found}", reader.place(root))
        return None
    if not _valid(root, _ROOTS[name], file, problems):
        return None
    reader.warn_of_ignored(root, proposing=name == "SystemStructureDescription")
    return reader


def _valid(root: Element, schema: str, file: str, problems: Problems) -> bool:
    """Validate a document against the schema called `schema` (without extension); True where that cannot be done.

    A later minor version may only add what can be ignored (SSP 1.0 section 2.2): it is read as the version known.
    """
    place = Reader(file, problems).place(root)
    text, version = root.get("version", ""), version_of(root)
    if version is None:
        problems.add(f"version {text} of the format is not supported" if text else "there is no version", place)
        return False
    if text.strip() not in ("1.0", "2.0"):
        problems.warn(f"version {text} of the format is read as {version}.0", place)
    folder = schema_folder(version)
    validator = None if folder is None or (version == 2 and text != "2.0") else _schema(folder, schema)
    if validator is None or validator.validate(root):
        return True
    entries: Any = validator.error_log
    for entry in entries:
        problems.add(re.sub(r"\{[^}]*\}", "", entry.message), Place(file, entry.line))
    return False
