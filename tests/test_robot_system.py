"""The robot's wiring and parameter sets in `ssp/` agree with the blocks, the parameters and the paper."""

from pathlib import Path

import pytest
from lxml import etree

from twip.cosim import load
from twip.cosim.ssp.parameter_file import parameters_of, write_parameter_set
from twip.fmi.blocks import block_folders, load_block
from twip.robot.parameters import value

SSP = Path(__file__).parents[1] / "ssp"
SSD = "{http://ssp-standard.org/SSP1/SystemStructureDescription}"
PAPER = {  # tables 2 and 4: T_c, T_s, v_s, sigma_2, magnitudes
    "left.forward": (7.272e-4, 6.301e-4, 0.4102, 1.877e-6),
    "left.reverse": (5.44e-4, 4.832e-4, 0.4102, 2.375e-6),
    "right.forward": (5.668e-4, 4.654e-4, 0.4102, 1.876e-6),
    "right.reverse": (4.556e-4, 4.653e-4, 0.4102, 1.252e-6),
}


@pytest.mark.parametrize("name", ["twip", "bench"])
def test_the_connectors_are_the_blocks_inputs_and_outputs_with_their_units(name):
    for component in etree.parse(SSP / name / "SystemStructure.ssd").iter(f"{SSD}Component"):
        block_name = Path(component.get("source")).stem
        block = load_block(block_folders()[block_name] / f"{block_name}.py")
        declared = {(v.name, v.causality, v.unit) for v in block.variables if v.causality in ("input", "output")}
        connectors = component.iter(f"{SSD}Connector")
        assert {(c.get("name"), c.get("kind"), c[0].get("unit")) for c in connectors} == declared


def test_both_motors_have_the_friction_of_tables_1_and_3(built):
    with load(built / "ssp" / "twip.ssp") as system:
        values = {entry.name: entry.value for entry in parameters_of(system)}
    for side in ("left", "right"):
        for kind in ("coulomb", "static", "viscous"):
            for direction in ("forward", "reverse"):
                name = f"{side}.{kind}_{direction}"
                assert values[name] == value(name)
    assert values["plant.hold_time"] == values["controller.rest_time"]


def test_blocks_agree_on_every_parameter_they_share(built):
    with load(built / "ssp" / "twip.ssp") as system:
        shared = {}
        for entry in parameters_of(system):
            component, _, name = entry.name.partition(".")
            if component in ("plant", "imu", "estimator", "controller"):
                shared.setdefault(name, set()).add(entry.value)
    assert {name for name, values in shared.items() if len(values) > 1} == set()


def test_the_nominal_parameter_set_is_what_the_system_starts_with(built, tmp_path):
    with load(built / "ssp" / "twip.ssp") as system:
        write_parameter_set(tmp_path / "nominal.ssv", "nominal", parameters_of(system))
    assert (SSP / "parameters" / "nominal.ssv").read_bytes() == (tmp_path / "nominal.ssv").read_bytes(), (
        "write it again: twip parameters ssp/twip.ssp --output-file ssp/parameters/nominal.ssv"
    )


@pytest.mark.parametrize("path", sorted((SSP / "parameters").glob("*.ssv")), ids=lambda p: p.stem)
def test_every_parameter_set_fits_the_robot(built, path):
    with load(built / "ssp" / "twip.ssp", parameters=[path]) as system:
        assert any(component.start_values for component in system.components)


def test_the_stribeck_set_is_tables_2_and_4(built):
    with load(built / "ssp" / "twip.ssp", parameters=[SSP / "parameters" / "stribeck.ssv"]) as system:
        values = {entry.name: entry.value for entry in parameters_of(system)}
    for key, expected in PAPER.items():
        side, direction = key.split(".")
        names = (f"coulomb_{direction}", f"static_{direction}", "stribeck_speed", f"viscous_{direction}")
        assert tuple(values[f"{side}.{name}"] for name in names) == expected


@pytest.mark.parametrize("name", ["twip", "bench"])
def test_omsimulator_is_told_the_type_and_the_step_of_the_system(built, name):
    """By its source (Model::getSystemType, SystemWC): in this place, with these prefixes taken literally."""
    root = etree.parse(SSP / name / "SystemStructure.ssd").getroot()
    path = ["ssd:System", "ssd:Annotations", "ssc:Annotation", "oms:Annotations", "oms:SimulationInformation"]
    element = root
    for tag in [*path, "oms:FixedStepMaster"]:
        children = element.iterchildren("{*}*")
        found = [child for child in children if f"{child.prefix}:{etree.QName(child).localname}" == tag]
        assert len(found) == 1, tag
        element = found[0]
    assert element.nsmap["oms"] == "https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd"
    assert element.getparent().getparent().getparent().get("type") == "org.openmodelica"
    assert element.get("description") == "oms-ma"
    assert {key: float(element.get(key)) for key in ("absoluteTolerance", "relativeTolerance")} == {
        "absoluteTolerance": 1e-4,
        "relativeTolerance": 1e-4,
    }
    assert float(element.get("stepSize")) == float(root.find(".//{*}Algorithm").get("stepSize"))
    with load(built / "ssp" / f"{name}.ssp") as system:
        assert not system.warnings
