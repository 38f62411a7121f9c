"""The model description says everything that the declaration says, in valid FMI 2.0."""

import math
import re
import zipfile
from dataclasses import replace

import pytest
from fmpy import read_model_description
from fmpy.validation import validate_fmu
from lxml import etree

from twip.fmi import declare
from twip.fmi.declare import Block, Variable, output
from twip.fmi.rules import broken_declarations
from twip.fmi.units import BASE_UNITS, UNITS

ATOMS = {
    **{name: {name: 1} for name in BASE_UNITS},
    "1": {},
    "Hz": {"s": -1},
    "N": {"kg": 1, "m": 1, "s": -2},
    "J": {"kg": 1, "m": 2, "s": -2},
    "W": {"kg": 1, "m": 2, "s": -3},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "Ohm": {"kg": 1, "m": 2, "s": -3, "A": -2},
    "H": {"kg": 1, "m": 2, "s": -2, "A": -2},
}
SCALES = {
    "deg": 180 / math.pi,
    "rpm": 60 / (2 * math.pi),
    "ms": 1e3,
    "mm": 1e3,
    "cm": 1e2,
    "g": 1e3,
    "mN": 1e3,
    "mA": 1e3,
}
"""How many of a display unit make its SI unit."""


def exponents(expression):
    """Read a unit's name as an expression: factors by dots, divisors by slashes, powers as trailing numbers."""
    total, sign, depth_sign = {}, 1, [1]
    for token in re.findall(r"[A-Za-z]+[0-9.]*[0-9]|[A-Za-z]+|1|[./()]", expression):
        if token == "/":
            sign = -1
        elif token == "(":
            depth_sign.append(sign)
            sign = 1
        elif token == ")":
            depth_sign.pop()
            sign = 1
        elif token != ".":
            name, power = re.fullmatch(r"([A-Za-z]+|1)([0-9.]*)", token).groups()
            for base, exponent in ATOMS[name].items():
                total[base] = total.get(base, 0) + exponent * float(power or 1) * sign * math.prod(depth_sign)
            sign = 1
    return {base: e for base, e in total.items() if e}


@pytest.mark.parametrize("unit", UNITS)
def test_the_table_of_units_agrees_with_the_units_names(unit):
    expected = exponents(unit)
    if UNITS[unit].exponents is None:
        assert any(e != int(e) for e in expected.values())
    else:
        assert UNITS[unit].exponents == expected
    for display, factor in UNITS[unit].display.items():
        power = int(re.fullmatch(r"[A-Za-z]+([0-9]?).*", display)[1] or 1)
        assert factor == pytest.approx(SCALES[re.match("[A-Za-z]+", display)[0]] ** power, rel=1e-15)


def test_fmpy_finds_nothing_to_complain_about(fmu_path, name):
    assert validate_fmu(str(fmu_path(name))) == []


def test_the_description_is_the_declaration(fmu_path, declared, name):
    block, description = declared(name), read_model_description(str(fmu_path(name)))
    variables = [v for v in block.variables if v.causality != "state"]
    assert [v.name for v in description.modelVariables] == [v.name for v in variables]
    for reference, (told, v) in enumerate(zip(description.modelVariables, variables, strict=True)):
        assert (told.causality, told.variability, told.type, told.description, told.valueReference) == (
            v.causality,
            v.variability,
            v.type,
            v.description,
            reference,
        )
        assert (told.unit, told.displayUnit) == (None if v.unit == "1" else v.unit, v.display_unit)
        assert [float(x) if x is not None else None for x in (told.min, told.max, told.nominal)] == [
            v.minimum if v.type != "Boolean" else None,
            v.maximum if v.type != "Boolean" else None,
            v.nominal,
        ]
        assert told.start == (None if v.start is None else str(v.start).lower() if v.type == "Boolean" else told.start)
        if v.start is not None and v.type != "Boolean":
            assert float(told.start) == v.start  # exactly


def test_outputs_depend_on_what_is_declared(fmu_path, declared, name):
    block, description = declared(name), read_model_description(str(fmu_path(name)))
    depends = {v.name: set(v.depends) for v in block.variables if v.causality == "output"}
    initially = {v.name: set(v.initially) for v in block.variables}
    parameters = {v.name for v in block.variables if v.causality == "parameter"}
    outputs = {u.variable.name: {d.name for d in u.dependencies} for u in description.outputs}
    initial = {u.variable.name: {d.name for d in u.dependencies} for u in description.initialUnknowns}
    assert outputs == depends
    assert initial == {n: d | initially[n] | parameters for n, d in depends.items()}
    assert all(set(u.dependenciesKind) <= {"dependent"} for u in description.outputs)


def test_units_of_the_description_have_base_units_and_degrees(fmu_path):
    units = {u.name: u for u in read_model_description(str(fmu_path("typed"))).unitDefinitions}
    assert units["rad"].baseUnit.rad == 1
    assert {d.name: d.factor for d in units["rad"].displayUnits} == {"deg": 180 / math.pi}


def test_capabilities_and_default_experiment(fmu_path, declared, name):
    description = read_model_description(str(fmu_path(name)))
    cosimulation, block = description.coSimulation, declared(name)
    assert cosimulation.canGetAndSetFMUstate
    assert cosimulation.canSerializeFMUstate
    assert cosimulation.canHandleVariableCommunicationStepSize
    assert cosimulation.needsExecutionTool
    assert not cosimulation.canBeInstantiatedOnlyOncePerProcess
    assert float(description.defaultExperiment.stepSize) == block.step_size
    assert float(description.defaultExperiment.stopTime) == block.stop_time
    assert description.license == "MIT"
    assert description.author
    assert {c.name for c in description.logCategories} == {"logStatusWarning", "logStatusDiscard", "logStatusError"}
    assert re.fullmatch(r"\{[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}\}", description.guid)


def test_dependency_indices_are_sorted(fmu_path, name):
    with zipfile.ZipFile(fmu_path(name)) as archive:
        tree = etree.fromstring(archive.read("modelDescription.xml"))
    for unknown in tree.iter("Unknown"):
        indices = [int(i) for i in unknown.get("dependencies").split()]
        assert indices == sorted(indices)


def nothing(*_):
    """Stand for initialization and step."""


GOOD = declare.input("force", "N", "a force")


@pytest.mark.parametrize(
    ("variable", "rule"),
    [
        (replace(GOOD, unit="pound"), r"block b: force \[pound\]: the unit is not in the table"),
        (replace(GOOD, display_unit="deg"), "'deg' is not a display unit of it"),
        (replace(GOOD, unit=None, display_unit="deg"), "'deg' is not a display unit of it"),
        (replace(GOOD, description=""), "the description is missing"),
        (replace(GOOD, start=None), "the start value is missing"),
        (replace(GOOD, minimum=1.0), "the start value 0.0 is out of bounds"),
        (replace(GOOD, minimum=1.0, maximum=-1.0, start=0.0), "the minimum must be below the maximum"),
        (replace(GOOD, nominal=0.0), "the nominal value must be positive"),
        (replace(GOOD, name="a force"), "must be made of identifiers"),
        (replace(GOOD, name="left.lambda"), "must be made of identifiers"),
        (replace(GOOD, causality="calculatedParameter", start=None), "unknown causality 'calculatedParameter'"),
        (replace(GOOD, variability="fixed"), "must be continuous or discrete"),
        (replace(GOOD, type="String", unit=None), "unknown type 'String'"),
        (replace(GOOD, type="Integer", unit=None), "a variable of type Integer must be discrete"),
        (replace(GOOD, type="Integer", variability="discrete"), "has neither unit nor nominal"),
        (Variable("force", "local", "continuous", description="x", depends=("push",)), "only outputs declare"),
        (Variable("force", "output", "continuous", start=1.0, description="x"), "start value is calculated"),
    ],
)  # fmt: skip
def test_a_broken_declaration_is_told(variable, rule):
    variables = (variable, output("result", None, "a result"), declare.input("push", "N", "another force"))
    block = Block("b", "a block", variables, nothing, nothing)
    problems = broken_declarations(block)
    assert len(problems) == 1
    assert re.search(rule, problems[0])


def test_a_block_without_outputs_name_or_description_is_told():
    problems = broken_declarations(Block("a.b", "", (GOOD,), nothing, nothing, step_size=0.0))
    assert len(problems) == 4
