"""Model descriptions of FMI 2.0: what the master uses of them is read, and what of that is wrong is told with its line.

Departures from the standard's schema that do not matter here are left to `overview.weaknesses`.
"""

import math
import pathlib

from ..model.fmu import Fmu
from ..reading.problems import Problems
from ..reading.xml import Element, Reader
from ..values.types import FMI2_TYPES, TYPES
from ..values.units import BASE_UNITS, Unit, lookup
from ..values.variable import Variable
from ..values.written import parse_value
from .description_checks import refuse_twice, usable_nominal, usable_step

_INITIAL: dict[str, dict[str, str | None]] = {
    "constant": {"output": "exact", "local": "exact"},
    "fixed": {"parameter": "exact", "calculatedParameter": "calculated", "local": "calculated"},
    "tunable": {"parameter": "exact", "calculatedParameter": "calculated", "local": "calculated"},
    "discrete": {"input": "exact", "output": "calculated", "local": "calculated"},
    "continuous": {"input": "exact", "output": "calculated", "local": "calculated", "independent": None},
}
"""Default of `initial` by variability and causality; what is not here is no combination (FMI 2.0.4 section 2.2.7)."""


def describe_fmi2(root: Element, path: pathlib.Path, name: str, sha256: str, problems: Problems) -> Fmu | None:
    """Return what the FMU at `path`, called `name` in messages, says of itself; None without co-simulation."""
    kind = root.find("CoSimulation")
    if kind is None:
        return None
    return _Description(f"{name}: modelDescription.xml", problems).fmu(root, kind, path, name, sha256)


class _Description(Reader):
    """Reads one model description."""

    def fmu(self, root: Element, kind: Element, path: pathlib.Path, name: str, sha256: str) -> Fmu:
        units = {unit.name: unit for item in root.iterfind("UnitDefinitions/Unit") for unit in self._unit(item)}
        types = {self.required(item, "name"): item for item in root.iterfind("TypeDefinitions/SimpleType")}
        refuse_twice(root, self.file, self.problems)
        items = list(root.iterfind("ModelVariables/ScalarVariable"))
        for odd in root.iterfind("ModelVariables/*"):
            if isinstance(odd.tag, str) and odd.tag != "ScalarVariable":
                self.problems.add(f"{odd.tag} in ModelVariables is no ScalarVariable", self.place(odd))
        in_order = [self._variable(item, types, units) for item in items]
        variables: dict[str, Variable] = {}
        for item, variable in zip(items, in_order, strict=True):
            if variable is not None and variable.name in variables:
                self.problems.add(f"variable {variable.name} is there twice", self.place(item))
            if variable is not None:
                variables[variable.name] = variable
        experiment = root.find("DefaultExperiment")
        saves = self.boolean(kind, "canGetAndSetFMUstate")
        return Fmu(
            path, name, self.required(root, "guid"), self.required(kind, "modelIdentifier"),
            root.get("generationTool", ""), sha256, variables, self._feedthrough(root, in_order, variables), units,
            self.boolean(kind, "canBeInstantiatedOnlyOncePerProcess"),
            None if experiment is None else self._step(experiment),
            saves and self.boolean(kind, "canSerializeFMUstate"), saves,
            self.boolean(kind, "canHandleVariableCommunicationStepSize"),
        )  # fmt: skip

    def _step(self, experiment: Element) -> float | None:
        size = self.number(experiment, "stepSize")
        return size if size is None else usable_step(size, self.problems, self.place(experiment))

    def _unit(self, item: Element) -> list[Unit]:
        name, base = self.required(item, "name"), item.find("BaseUnit")
        if base is None:
            return [Unit(name)]
        powers = [self.integer(base, symbol) if base.get(symbol) is not None else 0 for symbol in BASE_UNITS]
        factor, offset = self.number(base, "factor", 1.0), self.number(base, "offset", 0.0)
        if factor == 0.0:
            self.problems.add(f"unit {name}: the factor", self.place(base), rule="must not be zero")
        return [Unit(name, tuple(power or 0 for power in powers), factor or 1.0, offset or 0.0)]

    def _variable(self, item: Element, types: dict[str, Element], units: dict[str, Unit]) -> Variable | None:
        """Return the variable that a `ScalarVariable` describes, None for one that cannot be used."""
        checking = self.problems.checking()
        name, reference = self.required(item, "name"), self.integer(item, "valueReference")
        if reference is not None and not 0 <= reference < 2**32:
            self.problems.add(
                f"valueReference = {reference} of {name}", self.place(item), rule="must be a number of 32 bits"
            )
        values = [child for child in item if child.tag in FMI2_TYPES]
        value = values[0] if values else None
        causality, variability = item.get("causality", "local"), item.get("variability", "continuous")
        initial = item.get("initial")
        if causality not in _INITIAL.get(variability, ()):
            self.problems.add(f"variable {name}: there is no {variability} {causality}", self.place(item))
        elif initial not in (None, "exact", "approx", "calculated"):
            self.problems.add(f"variable {name}: initial {initial!r} is unknown", self.place(item))
        if value is None:
            self.problems.add(f"variable {name} has no type", self.place(item))
            return None
        if len(values) > 1:
            self.problems.add(f"variable {name} has more than one type", self.place(item))
        declared, inner = value.get("declaredType"), None
        if declared is None and value.tag == "Enumeration":
            self.problems.add(f"variable {name}: an Enumeration needs a declaredType", self.place(value))
        if declared is not None and declared not in types:
            self.problems.add(f"variable {name}: type {declared} is not defined", self.place(value))
        elif declared is not None:
            inner = types[declared].find(str(value.tag))
            if inner is None:
                self.problems.add(f"variable {name}: type {declared} is no {value.tag}", self.place(value))
        sources = [value] if inner is None else [value, inner]
        minimum, maximum, nominal = (self._bound(sources, attribute) for attribute in ("min", "max", "nominal"))
        numbers = (
            [] if inner is None else [(i.get("name", ""), self.integer(i, "value")) for i in inner.findall("Item")]
        )
        labels = tuple((label, number) for label, number in numbers if number is not None)
        start = self._start(name, value)
        unit = next((source.get("unit") for source in sources if source.get("unit") is not None), None)
        relative = next((source for source in sources if source.get("relativeQuantity") is not None), None)
        if reference is None or checking.failed:
            return None
        type_ = str(value.tag)
        return Variable(
            name, reference, type_, "Integer" if type_ == "Enumeration" else type_, causality, variability,
            _INITIAL[variability][causality] if initial is None else initial, lookup(unit, units), minimum, maximum,
            usable_nominal(name, nominal, self.problems, self.place(value)), labels, start, item.get("description", ""),
            relative=relative is not None and self.boolean(relative, "relativeQuantity"),
        )  # fmt: skip

    def _bound(self, sources: list[Element], attribute: str) -> float | None:
        """Return an attribute of the first element that has it; it may be infinite."""
        source = next((element for element in sources if element.get(attribute) is not None), None)
        if source is None:
            return None
        if source.tag != "Real":
            return self.integer(source, attribute)
        infinite = {"INF": math.inf, "-INF": -math.inf}.get(source.get(attribute, "").strip())
        return self.number(source, attribute) if infinite is None else infinite

    def _start(self, name: str, value: Element) -> str | None:
        """Return a start value as it is written; what is none of its type is a problem."""
        text, type_ = value.get("start"), str(value.tag)
        kind = "Integer" if type_ == "Enumeration" else type_
        undetermined = type_ == "Real" and (text or "").strip() in ("INF", "-INF", "NaN")
        if text is not None and not undetermined and parse_value(text, kind) is None:
            self.problems.add(
                f"start = {text!r} of variable {name}", self.place(value), rule=f"must be {TYPES[kind].rule}"
            )
        return text

    def _feedthrough(
        self, root: Element, in_order: list[Variable | None], variables: dict[str, Variable]
    ) -> dict[str, frozenset[str]]:
        inputs = frozenset(v.name for v in variables.values() if v.causality == "input")
        result = {v.name: inputs for v in variables.values() if v.causality == "output"}
        for unknown in root.iterfind("ModelStructure/Outputs/Unknown"):
            output = self._indexed(unknown, "index", unknown.get("index", ""), in_order)
            if output is not None and output.causality != "output":
                self.problems.warn(
                    f"ModelStructure has {output.name} for an output, which it is not", self.place(unknown)
                )
            dependencies = unknown.get("dependencies")
            if dependencies is None:
                continue
            found = [self._indexed(unknown, "dependencies", text, in_order) for text in dependencies.split()]
            if output is not None and output.name in result:
                result[output.name] = inputs & {v.name for v in found if v is not None}
        return result

    def _indexed(self, unknown: Element, attribute: str, text: str, in_order: list[Variable | None]) -> Variable | None:
        """Return a variable by its index, which counts from 1."""
        if text.isascii() and text.isdigit() and len(text) < 10 and 1 <= int(text) <= len(in_order):
            return in_order[int(text) - 1]
        self.problems.add(
            f"{attribute} {text!r} of an output in ModelStructure must be the index of one of the {len(in_order)}"
            " variables, from 1 on",
            self.place(unknown),
        )
        return None
