"""Model descriptions of FMI 2.0, as fmpy reads them."""

import pathlib
from collections import Counter

import fmpy
from fmpy.model_description import ModelDescription, ModelVariable

from .problems import Place, Problems
from .units import BASE_UNITS, Unit, lookup
from .variable import Fmu, Variable


def describe_fmi2(path: pathlib.Path, name: str, sha256: str, problems: Problems, place: Place) -> Fmu | None:
    """Return what the FMU at `path`, called `name` in messages, says of itself; None without co-simulation."""
    try:
        description = fmpy.read_model_description(str(path), validate=False)
        if description.coSimulation is None:
            return None
        return _convert(description, path, name, sha256, problems, place)
    except Exception as error:  # fmpy raises bare exceptions of many kinds on a malformed description
        problems.add(f"FMU {name}: modelDescription.xml cannot be read: {type(error).__name__}: {error}", place)
        return None


def _convert(
    description: ModelDescription,
    path: pathlib.Path,
    name: str,
    sha256: str,
    problems: Problems,
    place: Place,
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
    varies = bool(description.coSimulation.canHandleVariableCommunicationStepSize)
    return Fmu(
        path, name, description.guid or "", description.coSimulation.modelIdentifier, description.generationTool or "",
        sha256, variables, feedthrough, units, only_once, step, serializes, saves, varies,
    )  # fmt: skip


def _variable(v: ModelVariable, units: dict[str, Unit]) -> Variable:
    declared = v.declaredType

    def inherited(attribute: str) -> str | None:
        own = getattr(v, attribute, None)
        return own if own is not None or declared is None else getattr(declared, attribute, None)

    minimum, maximum, nominal = (inherited(a) for a in ("min", "max", "nominal"))
    items = () if declared is None else tuple((str(item.name), int(item.value)) for item in declared.items)
    return Variable(
        v.name, v.valueReference, v.type, "Integer" if v.type == "Enumeration" else v.type,
        v.causality, v.variability, v.initial, lookup(inherited("unit"), units),
        None if minimum is None else float(minimum), None if maximum is None else float(maximum),
        abs(float(nominal)) if nominal is not None else 1.0, items,
        None if v.start is None else str(v.start), v.description or "",
    )  # fmt: skip
