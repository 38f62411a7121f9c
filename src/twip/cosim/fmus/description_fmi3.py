"""Model descriptions of FMI 3.0: checked against the standard's schema, then read for co-simulation.

An array variable becomes its elements, `x[1]`, `x[2,1]`, the last index running fastest (FMI 3.0.1 section 2.4.7.5).
Sizes may come from structural parameters; these keep their start values.
"""

import functools
import itertools
import math
import pathlib
from typing import Any

import fmpy
from lxml import etree

from ..model.fmu import Fmu
from ..reading.problems import Place, Problems
from ..reading.xml import Element
from ..values.types import canonical
from ..values.units import BASE_UNITS, Unit, lookup
from ..values.variable import Variable
from .description_checks import refuse_twice, usable_nominal, usable_step

MAXIMUM_ELEMENTS = 100_000
"""Most scalar variables of an FMU, the elements of its arrays counted."""
_PARAMETERS = ("parameter", "calculatedParameter", "structuralParameter")
_ALLOWED = {
    "constant": ("output", "local"),
    "fixed": (*_PARAMETERS, "local"),
    "tunable": (*_PARAMETERS, "local"),
    "discrete": ("input", "output", "local"),
    "continuous": ("input", "output", "local", "independent"),
}
"""Causalities by variability (FMI 3.0.1 section 2.4.7.4)."""
_SCHEMA = pathlib.Path(fmpy.__file__).parent / "schema" / "fmi3" / "fmi3ModelDescription.xsd"


def describe_fmi3(root: Element, path: pathlib.Path, name: str, sha256: str, problems: Problems) -> Fmu | None:
    """Return what the FMU at `path`, called `name` in messages, says of itself; None without co-simulation.

    What the master cannot do, and what the schema forbids, is a problem with the line of the model description.
    """
    file = f"{name}: modelDescription.xml"
    validator = _schema()
    if not validator.validate(root):
        entries: Any = validator.error_log
        for entry in entries:
            problems.add(entry.message, Place(file, entry.line))
        return None
    kind = root.find("CoSimulation")
    if kind is None:
        return None
    return _Reader(file, problems).fmu(root, kind, path, name, sha256)


@functools.cache
def _schema() -> etree.XMLSchema:
    return etree.XMLSchema(etree.parse(_SCHEMA))


def _flag(element: Element, attribute: str) -> bool:
    return element.get(attribute, "false").strip() in ("true", "1")


class _Reader:
    def __init__(self, file: str, problems: Problems):
        self.file = file
        self.problems = problems
        self.units: dict[str, Unit] = {}
        self.types: dict[str, Element] = {}
        self.references: dict[int, Element] = {}
        self.elements: dict[int, list[Variable]] = {}
        """The variables of each value reference, without their aliases."""

    def place(self, element: Element) -> Place:
        line: Any = element.sourceline
        return Place(self.file, line)

    def fmu(self, root: Element, kind: Element, path: pathlib.Path, name: str, sha256: str) -> Fmu:
        self._read_units(root)
        refuse_twice(root, self.file, self.problems)
        self.types = {str(item.get("name")): item for item in root.iterfind("TypeDefinitions/*")}
        items = [item for item in root.iterfind("ModelVariables/*") if isinstance(item.tag, str)]
        for item in items:
            reference = int(item.get("valueReference", ""))
            if reference in self.references:
                self.problems.add(f"value reference {reference} is there twice", self.place(item))
            self.references[reference] = item
        variables: dict[str, Variable] = {}
        for item in items:
            for variable in self._variables(item, MAXIMUM_ELEMENTS - len(variables)):
                if variable.name in variables:
                    self.problems.add(f"variable {variable.name} is there twice", self.place(item))
                variables[variable.name] = variable
        experiment = root.find("DefaultExperiment")
        step = None
        if experiment is not None and "stepSize" in experiment.attrib:
            step = usable_step(float(experiment.get("stepSize", "")), self.problems, self.place(experiment))
        saves = _flag(kind, "canGetAndSetFMUState")
        return Fmu(
            path, name, root.get("instantiationToken", ""), kind.get("modelIdentifier", ""),
            root.get("generationTool", ""), sha256, variables, self._feedthrough(root, variables), self.units,
            _flag(kind, "canBeInstantiatedOnlyOncePerProcess"), step,
            saves and _flag(kind, "canSerializeFMUState"), saves,
            _flag(kind, "canHandleVariableCommunicationStepSize"), root.get("fmiVersion", ""),
        )  # fmt: skip

    def _read_units(self, root: Element) -> None:
        for item in root.iterfind("UnitDefinitions/Unit"):
            name, base = str(item.get("name")), item.find("BaseUnit")
            if base is None:
                self.units[name] = Unit(name)
                continue
            factor, offset = float(base.get("factor", "1")), float(base.get("offset", "0"))
            if factor == 0.0 or not math.isfinite(factor) or not math.isfinite(offset):
                self.problems.add(
                    f"unit {name}: factor and offset", self.place(base), rule="must be finite, factor not zero"
                )
                continue
            self.units[name] = Unit(name, tuple(int(base.get(s, "0")) for s in BASE_UNITS), factor, offset)

    def _variables(self, item: Element, room: int) -> list[Variable]:
        """Return the scalar variables of an element of ModelVariables, at most `room` of them, and its aliases."""
        name, type_ = str(item.get("name")), item.tag
        if type_ == "Clock":
            self.problems.add(
                f"variable {name} is a Clock: clocks need event mode, which is not used", self.place(item)
            )
            return []
        if "clocks" in item.attrib:
            self.problems.add(
                f"variable {name} is clocked: clocks need event mode, which is not used", self.place(item)
            )
            return []
        shape = self._shape(item, name)
        if shape is None:
            return []
        count = math.prod(shape)
        aliases = [str(alias.get("name")) for alias in item.iterfind("Alias")]
        if count * (1 + len(aliases)) > room:
            self.problems.add(
                f"variable {name}: with its {count} elements the FMU has more than {MAXIMUM_ELEMENTS} variables",
                self.place(item),
            )
            return []
        starts = self._starts(item, name, count)
        own = self._named(item, name, shape, starts, None)
        self.elements[int(item.get("valueReference", ""))] = own
        return own + [v for alias in aliases for v in self._named(item, alias, shape, starts, name)]

    def _shape(self, item: Element, name: str) -> tuple[int, ...] | None:
        """Return the sizes of an array variable, () for a scalar one, None when they are not known."""
        sizes = []
        for dimension in item.iterfind("Dimension"):
            size, source = dimension.get("start"), dimension.get("valueReference")
            if source is not None:
                parameter = self.references.get(int(source))
                if parameter is None or parameter.get("causality") != "structuralParameter":
                    self.problems.add(
                        f"variable {name}: its size, value reference {source}, is not a structural parameter",
                        self.place(dimension),
                    )
                    return None
                size = parameter.get("start")
            if size is None or not size.strip().lstrip("+").isdigit():
                self.problems.add(f"variable {name} has no size", self.place(dimension))
                return None
            sizes.append(int(size))
        return tuple(sizes)

    def _starts(self, item: Element, name: str, count: int) -> list[str | None]:
        """Return the start value of each element; one value counts for all."""
        if item.tag in ("String", "Binary"):
            values = [str(start.get("value")) for start in item.iterfind("Start")]
        else:
            values = item.get("start", "").split()
        if len(values) == 1 or not values:
            return [values[0] if values else None] * count
        if len(values) != count:
            elements = f"{count} element{'s' * (count != 1)}"
            self.problems.add(f"variable {name} has {len(values)} start values for {elements}", self.place(item))
        return [*values, *[None] * count][:count]

    def _named(
        self, item: Element, name: str, shape: tuple[int, ...], starts: list[str | None], alias_of: str | None
    ) -> list[Variable]:
        declared = self.types.get(item.get("declaredType", ""))
        if declared is None and item.get("declaredType") is not None:
            self.problems.add(f"variable {name}: type {item.get('declaredType')} is not defined", self.place(item))
        elif declared is not None and declared.tag != f"{item.tag}Type":
            self.problems.add(f"variable {name}: type {declared.get('name')} is no {item.tag}", self.place(item))
            declared = None

        def inherited(attribute: str) -> str | None:
            own = item.get(attribute)
            return own if own is not None or declared is None else declared.get(attribute)

        causality = item.get("causality", "local")
        variability = item.get("variability") or _variability(item, causality)
        if causality not in _ALLOWED.get(variability, ()):
            self.problems.add(f"variable {name}: there is no {variability} {causality}", self.place(item))
        type_ = canonical(item.tag)
        minimum, maximum, nominal = (inherited(a) for a in ("min", "max", "nominal"))
        usable = usable_nominal(name, None if nominal is None else float(nominal), self.problems, self.place(item))
        bound = float if type_ in ("Real", "Float32") else int
        items = (
            ()
            if declared is None
            else tuple((i.get("name", ""), int(i.get("value", ""))) for i in declared.iterfind("Item"))
        )
        indices = itertools.product(*(range(1, size + 1) for size in shape))
        return [
            Variable(
                f"{name}[{','.join(map(str, index))}]" if shape else name, int(item.get("valueReference", "")),
                type_, "Int64" if type_ == "Enumeration" else type_, causality, variability,
                item.get("initial") or _initial(causality, variability), lookup(inherited("unit"), self.units),
                None if minimum is None else bound(minimum), None if maximum is None else bound(maximum),
                usable, items if type_ == "Enumeration" else (), start,
                item.get("description", ""), name if shape else None, alias_of,
                (inherited("relativeQuantity") or "").strip() in ("true", "1"),
            )
            for index, start in zip(indices, starts, strict=True)
        ]  # fmt: skip

    def _feedthrough(self, root: Element, variables: dict[str, Variable]) -> dict[str, frozenset[str]]:
        inputs = frozenset(v.name for v in variables.values() if v.causality == "input")
        result = {v.name: inputs for v in variables.values() if v.causality == "output"}
        for output in root.iterfind("ModelStructure/Output"):
            named = self.references.get(int(output.get("valueReference", "")))
            if named is not None and named.get("causality") != "output":
                text = f"ModelStructure has {named.get('name')} for an output, which it is not"
                self.problems.warn(text, self.place(output))
            dependencies = output.get("dependencies")
            references = [int(text) for text in (dependencies or "").split()]
            for reference in (int(output.get("valueReference", "")), *references):
                if reference not in self.references:
                    self.problems.add(
                        f"an output in ModelStructure names value reference {reference}, which no variable has",
                        self.place(output),
                    )
            if dependencies is None:
                continue
            found = frozenset(v.name for r in references for v in self.elements.get(r, ()))
            found &= inputs
            for variable in self.elements.get(int(output.get("valueReference", "")), ()):
                result[variable.name] = found
        return result


def _variability(item: Element, causality: str) -> str:
    """Return the default (FMI 3.0.1 section 2.4.7.4)."""
    if causality in ("parameter", "calculatedParameter", "structuralParameter"):
        return "fixed"
    return "continuous" if item.tag in ("Float32", "Float64") else "discrete"


def _initial(causality: str, variability: str) -> str | None:
    """Return the default (FMI 3.0.1 section 2.4.7.4)."""
    if causality in ("input", "independent"):
        return None
    return "exact" if variability == "constant" or causality in ("parameter", "structuralParameter") else "calculated"
