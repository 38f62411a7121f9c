"""What the master needs to know of an FMU, read from its model description without loading any code of it."""

import functools
import hashlib
import pathlib
import zipfile
from collections import Counter
from dataclasses import dataclass

import fmpy
from fmpy.model_description import ModelDescription, ModelVariable

from .document import MAXIMUM_BYTES, Element, parse_xml
from .problems import Place, Problems
from .units import BASE_UNITS, Unit, lookup

RECORDED_TYPES = ("Real", "Integer", "Boolean")
NATIVE = "org.twip.native"
"""Name of the vendor annotation that announces native functions."""


@dataclass(frozen=True)
class Variable:
    """One scalar variable of an FMU."""

    name: str
    reference: int
    type: str
    """`Real`, `Integer`, `Boolean`, `String` or `Enumeration`."""
    causality: str
    variability: str
    initial: str | None
    unit: Unit | None
    minimum: float | None
    maximum: float | None
    nominal: float
    items: tuple[tuple[str, int], ...]
    """Names and values of an enumeration."""
    start: str | None
    """As the model description writes it."""
    description: str

    @property
    def settable(self) -> bool:
        """Whether a start value may be set before initialization (FMI 2.0.4 section 4.2.4)."""
        return self.variability != "constant" and (self.initial in ("exact", "approx") or self.causality == "input")

    @property
    def recorded_type(self) -> str:
        """The type as it is transferred and recorded: an enumeration travels as Integer."""
        return "Integer" if self.type == "Enumeration" else self.type


@dataclass(frozen=True)
class Fmu:
    """An FMI 2.0 co-simulation FMU."""

    path: pathlib.Path
    """The archive, or the folder of an unpacked FMU."""
    name: str
    """How messages call it."""
    guid: str
    model_identifier: str
    generation_tool: str
    sha256: str
    variables: dict[str, Variable]
    feedthrough: dict[str, frozenset[str]]
    """For each output, the inputs it depends on within the same instant; all of them where the FMU does not say."""
    units: dict[str, Unit]
    only_once: bool
    """Whether a process may hold one instance only."""
    step_size: float | None
    """Step of the default experiment in s."""
    serializes_state: bool
    """Whether the state of an instance can be saved as bytes and restored."""
    saves_state: bool
    """Whether an instance can go back to a state that it had."""
    native_reference: int | None = None
    """Value reference of the String that says where an instance's native functions are; see `native`."""

    def ports(self, causality: str) -> tuple[Variable, ...]:
        """The recorded inputs or outputs: Real, then Integer, then Boolean, each in the order of the model
        description.
        """
        found = [v for v in self.variables.values() if v.causality == causality and v.recorded_type in RECORDED_TYPES]
        return tuple(sorted(found, key=lambda v: RECORDED_TYPES.index(v.recorded_type)))


def read_fmu(path: pathlib.Path, name: str, problems: Problems, place: Place) -> Fmu | None:
    """Read the FMU at `path`, called `name` in messages; whatever makes it unusable here is a problem at `place`."""
    before = len(problems.lines)
    try:
        if path.is_dir():
            data, files = (
                (path / "modelDescription.xml").read_bytes(),
                {p.relative_to(path).as_posix() for p in path.rglob("*")},
            )
        else:
            with zipfile.ZipFile(path) as archive:
                files = set(archive.namelist())
                if archive.getinfo("modelDescription.xml").file_size > MAXIMUM_BYTES:
                    raise ValueError(f"modelDescription.xml is larger than {MAXIMUM_BYTES} bytes")
                data = archive.read("modelDescription.xml")
    except FileNotFoundError:
        problems.add(
            f"FMU {name} does not exist" if not path.exists() else f"FMU {name} has no modelDescription.xml", place
        )
        return None
    except KeyError:
        problems.add(f"FMU {name} has no modelDescription.xml", place)
        return None
    except Exception as error:  # zipfile raises many kinds on damaged archives
        problems.add(f"FMU {name} is not a readable zip archive: {error}", place)
        return None
    root = parse_xml(data, f"{name}: modelDescription.xml", problems)
    if root is None:
        return None
    version = root.get("fmiVersion")
    if version != "2.0":
        problems.add(f"FMU {name}: FMI {version} is not supported, only 2.0", place)
        return None
    try:
        description = fmpy.read_model_description(str(path), validate=False)
        native = _native_reference(root)
        fmu = None if description.coSimulation is None else _convert(description, path, name, native, problems, place)
    except Exception as error:  # fmpy raises bare exceptions of many kinds on a malformed description
        problems.add(f"FMU {name}: modelDescription.xml cannot be read: {type(error).__name__}: {error}", place)
        return None
    if fmu is None:
        problems.add(f"FMU {name} offers no co-simulation", place)
        return None
    library = f"binaries/{fmpy.platform}/{fmu.model_identifier}{fmpy.sharedLibraryExtension}"
    if library not in files:
        problems.add(f"FMU {name} has no binary for this platform ({library})", place)
    return fmu if len(problems.lines) == before else None


def _convert(
    description: ModelDescription, path: pathlib.Path, name: str, native: int | None, problems: Problems, place: Place
) -> Fmu:
    units = {}
    for unit in description.unitDefinitions:
        base = unit.baseUnit
        exponents = None if base is None else tuple(int(getattr(base, symbol)) for symbol in BASE_UNITS)
        factor, offset = (1.0, 0.0) if base is None else (float(base.factor), float(base.offset))
        if factor == 0.0:
            problems.add(f"FMU {name}: the factor of unit {unit.name} must not be zero", place)
            factor = 1.0
        units[unit.name] = Unit(unit.name, exponents, factor, offset)
    for variable, count in Counter(v.name for v in description.modelVariables).items():
        if count > 1:
            problems.add(f"FMU {name}: variable {variable} is there twice", place)
    variables = {v.name: _variable(v, units) for v in description.modelVariables}
    inputs = frozenset(v.name for v in variables.values() if v.causality == "input")
    feedthrough = {v.name: inputs for v in variables.values() if v.causality == "output"}
    for unknown in description.outputs:
        if unknown.dependencies is not None and unknown.variable.name in feedthrough:
            feedthrough[unknown.variable.name] = inputs & {v.name for v in unknown.dependencies}
    experiment = description.defaultExperiment
    only_once = bool(description.coSimulation.canBeInstantiatedOnlyOncePerProcess)
    step = None if experiment is None or experiment.stepSize is None else float(experiment.stepSize)
    saves = bool(description.coSimulation.canGetAndSetFMUstate)
    serializes = saves and bool(description.coSimulation.canSerializeFMUstate)
    return Fmu(
        path, name, description.guid or "", description.coSimulation.modelIdentifier, description.generationTool or "",
        _fingerprint(path), variables, feedthrough, units, only_once, step, serializes, saves, native,
    )  # fmt: skip


def _native_reference(description: Element) -> int | None:
    """Return the value reference that a model description announces, if it does."""
    for element in description.iterfind(f"VendorAnnotations/Tool[@name='{NATIVE}']/NativeFunctions"):
        text = element.get("valueReference", "")
        if text.isascii() and text.isdigit() and int(text) < 2**32:
            return int(text)
    return None


def _variable(v: ModelVariable, units: dict[str, Unit]) -> Variable:
    declared = v.declaredType

    def inherited(attribute: str) -> str | None:
        own = getattr(v, attribute, None)
        return own if own is not None or declared is None else getattr(declared, attribute, None)

    minimum, maximum, nominal = (inherited(a) for a in ("min", "max", "nominal"))
    items = () if declared is None else tuple((str(item.name), int(item.value)) for item in declared.items)
    return Variable(
        v.name, v.valueReference, v.type, v.causality, v.variability, v.initial, lookup(inherited("unit"), units),
        None if minimum is None else float(minimum), None if maximum is None else float(maximum),
        abs(float(nominal)) if nominal is not None else 1.0, items,
        None if v.start is None else str(v.start), v.description or "",
    )  # fmt: skip


@functools.lru_cache(maxsize=256)
def _digest(path: pathlib.Path, _size: int, _modified: int) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _fingerprint(path: pathlib.Path) -> str:
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
