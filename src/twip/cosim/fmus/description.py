"""Reads an FMU's model description without loading any code of it; what it holds is in `model.fmu`."""

import dataclasses
import functools
import hashlib
import pathlib
import zipfile

import fmpy

from ..model.fmu import Fmu
from ..reading.files import is_special, read_limited
from ..reading.problems import Place, Problems
from ..reading.xml import MAXIMUM_BYTES, Element, parse_xml
from ..values.written import out_of_range, parse_value
from .description_fmi2 import describe_fmi2
from .description_fmi3 import describe_fmi3

NATIVE = "org.twip.native"
"""Name of the vendor annotation that announces native functions."""


def read_fmu(path: pathlib.Path, name: str, problems: Problems, place: Place) -> Fmu | None:
    """Read the FMU at `path`, called `name` in messages; whatever makes it unusable here is a problem at `place`."""
    checking = problems.checking()
    if not path.exists():
        problems.add(f"FMU {name} does not exist", place)
        return None
    if is_special(path):
        problems.add(f"FMU {name} is a device or the like, not a file", place)
        return None
    try:
        data, files, sha256 = (_folder if path.is_dir() else _archive)(path)
    except (FileNotFoundError, KeyError):
        problems.add(f"FMU {name} has no modelDescription.xml", place)
        return None
    except Exception as error:  # zipfile raises many kinds on damaged archives
        what = "cannot be read" if isinstance(error, OSError) else "is not a readable zip archive"
        problems.add(f"FMU {name} {what}: {error}", place)
        return None
    root = parse_xml(data, f"{name}: modelDescription.xml", problems)
    if root is None:
        return None
    fmu = _describe(root, path, name, sha256, problems, place)
    if fmu is None:
        return None
    _check_bounds(fmu, problems)
    folder = fmpy.platform if fmu.fmi_version == "2.0" else fmpy.platform_tuple
    library = f"binaries/{folder}/{fmu.model_identifier}{fmpy.sharedLibraryExtension}"
    if library not in files:
        problems.add(f"FMU {name} has no binary for this platform ({library})", place)
    return fmu if not checking.failed else None


def _check_bounds(fmu: Fmu, problems: Problems) -> None:
    """Report bounds that exclude every value, and warn of start values beyond bounds."""
    place = Place(f"{fmu.name}: modelDescription.xml")
    for variable in fmu.variables.values():
        least, most = variable.minimum, variable.maximum
        if least is not None and most is not None and least > most:
            problems.add(f"variable {variable.name}: min = {least} is above max = {most}", place)
        elif variable.start is not None and (least, most) != (None, None):
            value = parse_value(variable.start, variable.type, variable.items)
            for line in () if value is None else out_of_range(variable, value):
                problems.warn(f"start value {line}", place)


def _folder(path: pathlib.Path) -> tuple[bytes, set[str], str]:
    """Return the model description of an unpacked FMU, its files' names, and its fingerprint."""
    file = path / "modelDescription.xml"
    if is_special(file):
        raise OSError("modelDescription.xml is a device or the like, not a file")
    files = {p.relative_to(path).as_posix() for p in path.rglob("*") if p.is_file()}
    return read_limited(file), files, fingerprint(path)


def _archive(path: pathlib.Path) -> tuple[bytes, set[str], str]:
    """Return the model description of a packed FMU, its files' names, and its fingerprint."""
    with zipfile.ZipFile(path) as archive:
        if archive.getinfo("modelDescription.xml").file_size > MAXIMUM_BYTES:
            raise ValueError(f"modelDescription.xml is larger than {MAXIMUM_BYTES // 1024 // 1024} MiB")
        return archive.read("modelDescription.xml"), set(archive.namelist()), fingerprint(path)


def _describe(
    root: Element, path: pathlib.Path, name: str, sha256: str, problems: Problems, place: Place
) -> Fmu | None:
    version = root.get("fmiVersion") or ""
    checking = problems.checking()
    if version == "2.0":
        fmu = describe_fmi2(root, path, name, sha256, problems)
    elif version.split(".")[:2] == ["3", "0"]:
        fmu = describe_fmi3(root, path, name, sha256, problems)
    else:
        problems.add(f"FMU {name}: FMI {version} is not supported, only 2.0 and 3.0", place)
        return None
    if fmu is None and not checking.failed:
        problems.add(f"FMU {name} offers no co-simulation", place)
    return fmu and dataclasses.replace(fmu, native_reference=_native_reference(root))


def _native_reference(description: Element) -> int | None:
    """Return the value reference that a model description announces, if it does."""
    for place in (f"VendorAnnotations/Tool[@name='{NATIVE}']", f"Annotations/Annotation[@type='{NATIVE}']"):
        for element in description.iterfind(f"{place}/NativeFunctions"):
            text = element.get("valueReference", "")
            if text.isascii() and text.isdigit() and int(text) < 2**32:
                return int(text)
    return None


@functools.lru_cache(maxsize=256)
def _digest(path: pathlib.Path, _size: int, _modified: int) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def fingerprint(path: pathlib.Path) -> str:
    """Return the SHA-256 of a file, or of the names and contents of a folder's files in order."""
    if path.is_file():
        return file_fingerprint(path)
    digest = hashlib.sha256()
    for file in sorted(p for p in path.rglob("*") if p.is_file()):
        digest.update(f"{file.relative_to(path).as_posix()}\0{file_fingerprint(file)}\n".encode())
    return digest.hexdigest()


def file_fingerprint(path: pathlib.Path) -> str:
    """Return the SHA-256 of a file in hexadecimal."""
    status = path.stat()
    return _digest(path, status.st_size, status.st_mtime_ns)
