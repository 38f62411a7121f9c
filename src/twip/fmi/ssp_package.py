"""Packs wiring and FMUs into an .ssp (SSP 1.0, section 4.1)."""

from pathlib import Path

from lxml import etree

from ..errors import TwipError
from .archive import write_archive

SSD = "SystemStructure.ssd"
NAMESPACE = "{http://ssp-standard.org/SSP1/SystemStructureDescription}"


def system_folders(root: Path) -> dict[str, Path]:
    """Return the folders `ssp/<name>/` that hold a SystemStructure.ssd, by name, sorted."""
    folder = root / "ssp"
    return {p.name: p for p in sorted(folder.iterdir()) if (p / SSD).is_file()} if folder.is_dir() else {}


def needed_fmus(folder: Path) -> set[str]:
    """Return the names of the FMUs (`plant`) that the components of a system refer to as `resources/plant.fmu`."""
    sources = {s for s in _sources(folder, "Component") if s.endswith(".fmu")}
    return {Path(s).stem for s in sources if not (folder / s).is_file()}


def package_system(folder: Path, fmus: Path, output: Path, ending: str = "") -> None:
    """Write the .ssp of a source folder: its files as they are, and from `fmus` the FMUs its components refer to.

    `ending` follows the names of the files in `fmus`: `_native` takes `plant_native.fmu` for `resources/plant.fmu`. A
    reference to what is neither there nor built raises TwipError.
    """
    paths = [p for p in sorted(folder.rglob("*")) if p.is_file() and not p.name.startswith(".")]
    files = {p.relative_to(folder).as_posix(): p.read_bytes() for p in paths}
    for source in _sources(folder, "Component"):
        fmu = fmus / f"{Path(source).stem}{ending}.fmu"
        if source in files:
            continue
        if not fmu.is_file():
            raise TwipError(f"{folder / SSD}: the component's source {source} is neither there nor built in {fmus}")
        files[source] = fmu.read_bytes()
    missing = [s for s in _sources(folder, "ParameterBinding") + _sources(folder, "ParameterMapping") if s not in files]
    if missing:
        raise TwipError(f"{folder / SSD}: no such file in {folder}: {', '.join(missing)}")
    write_archive(output, files, first=SSD)


def _sources(folder: Path, element: str) -> list[str]:
    """Return the `source` attributes of all elements of a name."""
    parser = etree.XMLParser(resolve_entities=False, no_network=True)
    try:
        tree = etree.parse(folder / SSD, parser)
    except etree.XMLSyntaxError as error:
        raise TwipError(f"{folder / SSD}: {error.msg}") from error
    return sorted({e.get("source", "") for e in tree.iter(NAMESPACE + element)} - {""})
