"""Model descriptions of FMI 2.0: what is read from them, and every mistake in what is used, with its line."""

import math
import zipfile

import fmpy
import pytest

from twip.cosim.fmus.description import read_fmu
from twip.cosim.reading.problems import Place, Problems

RANGE = " of an output in ModelStructure must be the index of one of the 7 variables, from 1 on"
BITS = " must be a number of 32 bits"
DESCRIPTION = """<fmiModelDescription fmiVersion="2.0" modelName="m" guid="{m}" generationTool="hand">
<CoSimulation modelIdentifier="m" canGetAndSetFMUstate="true" canHandleVariableCommunicationStepSize="1"/>
<UnitDefinitions>
<Unit name="degC"><BaseUnit K="1" offset="273.15"/><DisplayUnit name="degF" factor="1.8" offset="32"/></Unit>
<Unit name="mystery"/>
</UnitDefinitions>
<TypeDefinitions>
<SimpleType name="Temperature"><Real unit="degC" min="-273.15" max="INF" nominal="-20"/></SimpleType>
<SimpleType name="Gear">
<Enumeration><Item name="low" value="1"/><Item name="high" value="7"/></Enumeration></SimpleType>
</TypeDefinitions>
<DefaultExperiment stepSize="0.25"/>
<ModelVariables>
<ScalarVariable name="u" valueReference="0" causality="input">
<Real declaredType="Temperature" start="1.5"/></ScalarVariable>
<ScalarVariable name="n" valueReference="0" causality="input" variability="discrete">
<Integer start="3" max="9"/></ScalarVariable>
<!-- a remark -->
<ScalarVariable name="y" valueReference="1" causality="output"><Real unit="mystery"/></ScalarVariable>
<ScalarVariable name="k" valueReference="2" causality="parameter" variability="tunable">
<Real start="INF"/></ScalarVariable>
<ScalarVariable name="b" valueReference="3" variability="fixed" initial="exact"><Boolean start="true"/></ScalarVariable>
<ScalarVariable name="gear" valueReference="4" causality="input" variability="discrete">
<Enumeration declaredType="Gear" start="7"/></ScalarVariable>
<ScalarVariable name="word" valueReference="5" causality="output" variability="discrete" initial="exact">
<String start="hi"/></ScalarVariable>
</ModelVariables>
<ModelStructure><Outputs>
<Unknown index="3" dependencies="1 2"/>
<Unknown index="7"/>
</Outputs></ModelStructure>
</fmiModelDescription>"""


def read(folder, text, problems=None):
    with zipfile.ZipFile(folder / "m.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", text)
        archive.writestr(f"binaries/{fmpy.platform}/m{fmpy.sharedLibraryExtension}", "")
    problems = Problems() if problems is None else problems
    return read_fmu(folder / "m.fmu", "m.fmu", problems, Place("test")), problems.lines


def test_what_is_used_is_read(tmp_path):
    fmu, problems = read(tmp_path, DESCRIPTION)
    assert problems == []
    assert (fmu.guid, fmu.model_identifier, fmu.generation_tool, fmu.step_size) == ("{m}", "m", "hand", 0.25)
    assert (fmu.saves_state, fmu.serializes_state, fmu.varies_step, fmu.only_once) == (True, False, True, False)
    assert list(fmu.variables) == ["u", "n", "y", "k", "b", "gear", "word"]
    u, gear = fmu.variables["u"], fmu.variables["gear"]
    assert (u.minimum, u.maximum, u.nominal, u.start, u.initial) == (-273.15, math.inf, 20.0, "1.5", "exact")
    assert (u.unit.name, u.unit.exponents[4], u.unit.offset) == ("degC", 1, 273.15)
    assert fmu.variables["y"].unit.exponents is None
    assert (gear.items, gear.start, gear.recorded_type) == ((("low", 1), ("high", 7)), "7", "Integer")
    assert {name: v.initial for name, v in fmu.variables.items() if name in ("y", "k", "b")} == {
        "y": "calculated", "k": "exact", "b": "exact",
    }  # fmt: skip
    assert fmu.variables["n"].maximum == 9
    assert fmu.feedthrough == {"y": {"u", "n"}, "word": {"u", "n", "gear"}}


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('start="1.5"', 'start="abc"', "start = 'abc' of variable u must be a finite Real number"),
        ('start="1.5"', 'start="1,5"', "start = '1,5' of variable u must be a finite Real number"),
        ('start="3"', 'start="3.5"', "start = '3.5' of variable n must be an Integer of 32 bits"),
        ('start="3"', 'start="4294967296"', "start = '4294967296' of variable n must be an Integer of 32 bits"),
        ('start="true"', 'start="yes"', "start = 'yes' of variable b must be a Boolean (true or false)"),
        ('start="7"', 'start="high"', "start = 'high' of variable gear must be an Integer of 32 bits"),
        ('max="9"', 'max="many"', "max = 'many' of Integer must be a whole number"),
        ('min="-273.15"', 'min="cold"', "min = 'cold' of Real must be a finite number"),
        ('stepSize="0.25"', 'stepSize="fast"', "stepSize = 'fast' of DefaultExperiment must be a finite number"),
        ('offset="273.15"', 'offset="none"', "offset = 'none' of BaseUnit must be a finite number"),
        ('K="1"', 'K="one"', "K = 'one' of BaseUnit must be a whole number"),
        ('K="1"', 'K="1" factor="0"', "unit degC: the factor must not be zero"),
        ('name="high" value="7"', 'name="high" value="x"', "value = 'x' of Item must be a whole number"),
        ('valueReference="1"', 'valueReference="-1"', "valueReference = -1 of y" + BITS),
        (' valueReference="1"', "", "ScalarVariable has no valueReference"),
        ('name="n"', 'name="u"', "variable u is there twice"),
        ('<Boolean start="true"/>', "", "variable b has no type"),
        ('declaredType="Gear"', 'declaredType="Wheel"', "variable gear: type Wheel is not defined"),
        ('declaredType="Gear"', 'declaredType="Temperature"', "variable gear: type Temperature is no Enumeration"),
        (' variability="tunable"', "", "variable k: there is no continuous parameter"),
        ('initial="exact"><Boolean', 'initial="guess"><Boolean', "variable b: initial 'guess' is unknown"),
        ('FMUstate="true"', 'FMUstate="maybe"', "canGetAndSetFMUstate = 'maybe' of CoSimulation must be true or false"),
        ('modelIdentifier="m"', "", "CoSimulation has no modelIdentifier"),
        ('<Unit name="mystery"/>', '<Unit name="degC"/>', "unit degC is defined twice"),
        ('<SimpleType name="Gear">', '<SimpleType name="Temperature">', "type Temperature is defined twice"),
        ('<Boolean start="true"/>', '<Boolean/><Real/>', "variable b has more than one type"),
        (' declaredType="Gear"', "", "variable gear: an Enumeration needs a declaredType"),
        ('valueReference="1"', f'valueReference="{2**32}"', f"valueReference = {2**32} of y" + BITS),
        ('offset="273.15"', 'offset="273.15" factor="nan"', "factor = 'nan' of BaseUnit must be a finite number"),
        ('dependencies="1 2"', 'dependencies="-1"', "dependencies '-1'" + RANGE),
        ('index="7"', 'index="8"', "index '8'" + RANGE),
        ('index="7"', 'index="0"', "index '0'" + RANGE),
        ('dependencies="1 2"', 'dependencies="1 99"', "dependencies '99'" + RANGE),
        ('dependencies="1 2"', 'dependencies="u"', "dependencies 'u'" + RANGE),
    ],
)  # fmt: skip
def test_a_mistake_is_told_with_its_line(tmp_path, old, new, said):
    assert DESCRIPTION.count(old) == 1
    text = DESCRIPTION.replace(old, new)
    fmu, problems = read(tmp_path, text)
    line = next(i for i, row in enumerate(DESCRIPTION.splitlines(), 1) if old in row)
    assert fmu is None
    assert f"{said} (m.fmu: modelDescription.xml line {line})" in problems


def test_all_mistakes_are_told_together(tmp_path):
    text = DESCRIPTION.replace('start="1.5"', 'start="x"').replace('start="true"', 'start="y"')
    assert len(read(tmp_path, text.replace('index="7"', 'index="9"'))[1]) == 3


@pytest.mark.parametrize(
    ("old", "new", "said", "meant"),
    [
        ('nominal="-20"', 'nominal="0"', "nominal = 0.0 of variable u must be positive, it is taken for 1", 1.0),
        (
            'stepSize="0.25"',
            'stepSize="-1"',
            "stepSize = -1.0 of DefaultExperiment must be positive, it is ignored",
            None,
        ),
        ('index="7"', 'index="6"', "ModelStructure has gear for an output, which it is not", {"u", "n", "gear"}),
    ],
)
def test_what_makes_no_sense_and_does_no_harm_is_warned_of(tmp_path, old, new, said, meant):
    assert DESCRIPTION.count(old) == 1
    problems = Problems()
    fmu = read(tmp_path, DESCRIPTION.replace(old, new), problems)[0]
    where = 'name="u"' if "nominal" in old else old
    line = next(i for i, row in enumerate(DESCRIPTION.splitlines(), 1) if where in row) + ("nominal" in old)
    assert problems.lines == []
    assert problems.warnings == [f"{said} (m.fmu: modelDescription.xml line {line})"]
    assert meant in (fmu.variables["u"].nominal, fmu.step_size, fmu.feedthrough["word"])
