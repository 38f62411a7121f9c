"""The parameter sets that an identification leaves: for the robot and for the bench."""

from collections.abc import Mapping
from pathlib import Path

from ...cosim import BASE_UNITS, ParameterEntry, Unit, write_parameter_set
from ...fmi import UNITS
from ...robot import value
from .estimate import weighted_mean
from .friction import WAYS
from .identify import Identification

KINDS = ("coulomb", "static", "viscous")


def motor_parameters(found: Identification) -> dict[str, float]:
    """Return the motor's friction parameters that are identified, by their names in the motor's block.

    A static friction that is not identifiable is set to the Coulomb friction: no Stribeck effect, as nothing showed
    any. The block has one Stribeck speed for both directions: the mean, weighted by the intervals.
    """
    values: dict[str, float] = {}
    for way in WAYS.values():
        for kind in KINDS:
            estimate = found[f"{kind}_{way}"]
            if estimate.value is not None:
                values[estimate.name] = estimate.value
            elif kind == "static" and (coulomb := values.get(f"coulomb_{way}")) is not None:
                values[estimate.name] = coulomb
    speeds = [found[f"stribeck_speed_{way}"] for way in WAYS.values()]
    known = [speed for speed in speeds if speed.identifiable]
    if known:
        values["stribeck_speed"] = weighted_mean(known)
    return values


def wheel_inertia(inertia: float, gear_ratio: float, rotor_and_gear: float) -> float:
    """Return the wheel's inertia [kg.m2] that makes up the inertia on the motor shaft: J_w = n^2 (J - J_m - J_redu).

    inertia J and rotor_and_gear J_m + J_redu in kg.m2 on the motor shaft. Source: paper eq (12), with the wheel's own
    inertia in the place of a uniform disc's.
    """
    return gear_ratio**2 * (inertia - rotor_and_gear)


def robot_parameters(
    sides: Mapping[str, Identification],
    gear_ratio: float = value("gear_ratio"),
    rotor_and_gear: float = value("rotor_inertia") + value("gear_inertia"),
) -> dict[str, tuple[float, str]]:
    """Return value and unit by `component.variable` of the robot's SSP, for the sides (`left`, `right`) identified.

    Friction goes to the motor and to the controller, which compensates it. The inertia goes to the wheels, as rotor and
    gear are taken as known; the robot has one wheel inertia, so two sides are averaged, weighted by their intervals. It
    is left out where the inertia is not larger than that of rotor and gear.
    """
    found: dict[str, tuple[float, str]] = {}
    for side, identification in sides.items():
        for name, number in motor_parameters(identification).items():
            unit = _unit_of(name)
            found[f"{side}.{name}"] = (number, unit)
            if name.startswith(("coulomb", "viscous")):
                found[f"controller.{side}.{name}"] = (number, unit)
    inertias = [i.inertia for i in sides.values() if i.inertia.identifiable]
    if inertias:
        wheel = wheel_inertia(weighted_mean(inertias), gear_ratio, rotor_and_gear)
        if wheel > 0.0:
            found |= {f"{block}.wheel_inertia": (wheel, "kg.m2") for block in ("plant", "controller")}
    return found


def bench_parameters(found: Identification) -> dict[str, tuple[float, str]]:
    """Return value and unit by `component.variable` of the bench's SSP."""
    values = {f"motor.{name}": (number, _unit_of(name)) for name, number in motor_parameters(found).items()}
    if found.inertia.value is not None:
        values["bench.bench_inertia"] = (found.inertia.value, "kg.m2")
    return values


def write(path: Path, name: str, parameters: Mapping[str, tuple[float, str]]) -> None:
    """Write parameters as a set (.ssv) that `twip run --parameters` takes. Raises TwipError if it cannot be written."""
    entries = []
    for full_name, (number, unit) in parameters.items():
        powers = UNITS[unit].exponents or {}
        exponents = tuple(powers.get(symbol, 0) for symbol in BASE_UNITS)
        entries.append(ParameterEntry(full_name, "Real", float(f"{number:.6g}"), Unit(unit, exponents)))
    write_parameter_set(path, name, entries)


def _unit_of(name: str) -> str:
    if name.startswith("viscous"):
        return "N.m.s/rad"
    return "rad/s" if name == "stribeck_speed" else "N.m"
