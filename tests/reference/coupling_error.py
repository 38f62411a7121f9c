"""How far a co-simulated robot is from the reference, by coupling and communication step.

The robot is the one of `ssp/twip` without sensor and estimator: the controller gets the plant's true state, and the
friction compensation is smooth. Its inputs then come from states alone, so Gauss–Seidel runs it before the motors, and
in the step that begins at t_k it sees t_k and drives from t_k on; an offset of one step puts its ticks there.
"""

import csv
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from math import pi, radians
from pathlib import Path

import numpy as np
from lxml import etree
from monolithic import SAMPLE_TIME, Scenario, Solution, solve
from monolithic_events import PITCH

from twip.cosim import Algorithm, Inputs, Result, load, simulate

ROOT = Path(__file__).resolve().parents[2]
STORED = Path(__file__).with_name("coupling_error.csv")
SSD = "SystemStructure.ssd"
SPACE = "{http://ssp-standard.org/SSP1/SystemStructureDescription}"
SEEN = ("pitch", "pitch_rate", "wheel_rate", "yaw", "yaw_rate", "left.shaft_speed", "right.shaft_speed")

STEPS = (2e-3, 1e-3, 5e-4, 2.5e-4, 1e-4)
"""Communication steps, in s. 2 ms does not divide the sample time of 5 ms: every other tick waits 1 ms."""

SMOOTH = ("compensation_rest_speed", 0.0)
"""Compensation without the jump that follows the command's sign at rest."""
SCENARIOS = {
    "stand-up with a turn": Scenario(
        3.0, radians(10.0), controller=(SMOOTH,), references=((1.0, "yaw_reference", pi / 2),)
    ),
    "turn while standing up": Scenario(
        1.5, radians(10.0), controller=(SMOOTH,), references=((0.0, "yaw_reference", pi / 2),)
    ),
    "stick–slip standing": Scenario(6.0, radians(1.0), controller=(SMOOTH, ("speed_loop", 1.0))),
    "rolling": Scenario(
        1.0, radians(10.0), 10.0, controller=(SMOOTH,), references=((0.0, "yaw_reference", radians(30.0)),)
    ),
}


@dataclass(frozen=True)
class Scheme:
    """A coupling, as `simulate` takes it."""

    coupling: str
    mid_step: tuple[str, ...] = ()


SCHEMES = {
    "Jacobi": Scheme("jacobi"),
    "Gauss–Seidel": Scheme("gauss-seidel"),
    "Gauss–Seidel, mid-step": Scheme("gauss-seidel", ("left.shaft_speed", "right.shaft_speed")),
}
DEFAULT = "Gauss–Seidel, mid-step"
"""The scheme that the robot's SSD asks for."""


def true_state_robot(built: Path, folder: Path) -> Path:
    """Write the robot without sensor and estimator into `folder`, with the FMUs of `built`, and return `folder`."""
    tree = etree.parse(ROOT / "ssp" / "twip" / SSD)
    for kind, end in (("Component", "name"), ("Connection", "startElement"), ("Connection", "endElement")):
        for element in list(tree.iter(SPACE + kind)):
            if element.get(end) in ("imu", "estimator"):
                element.getparent().remove(element)
    connections = next(tree.iter(SPACE + "Connections"))
    for name in SEEN:
        ends = {"startElement": "plant", "endElement": "controller", "startConnector": name, "endConnector": name}
        etree.SubElement(connections, SPACE + "Connection", ends)
    (folder / "resources").mkdir(parents=True, exist_ok=True)
    for name in ("motor", "plant", "controller"):
        shutil.copy(built / "fmus" / f"{name}.fmu", folder / "resources")
    tree.write(folder / SSD, encoding="UTF-8", xml_declaration=True)
    return folder


def cosimulate(
    robot: Path, scenario: Scenario, scheme: Scheme, step_size: float, inner_step: float | None = None
) -> Result:
    """Run a scenario with the built FMUs; `inner_step` [s] replaces the plant's own."""
    values = {
        "plant.hold_time": 0.0,
        "plant.pitch_start": scenario.pitch_start,
        "plant.wheel_rate_start": scenario.wheel_rate_start,
        "controller.rest_time": 0.0,
        "controller.speed_loop": False,
        "controller.sample_time": SAMPLE_TIME,
        "controller.sample_offset": step_size,
    }
    switches = ("speed_loop",)
    values |= {f"controller.{n}": bool(v) if n in switches else v for n, v in scenario.controller}
    if inner_step is not None:
        values["plant.inner_step"] = inner_step
    inputs = None
    if scenario.references:
        inputs = robot / "inputs.csv"
        inputs.write_text(series(scenario), encoding="utf-8")
    with load(robot, start_values=values) as system:
        return simulate(
            system,
            stop_time=scenario.duration,
            step_size=step_size,
            inputs=Inputs(file=inputs),
            algorithm=Algorithm(coupling=scheme.coupling, mid_step=scheme.mid_step),
        )


def series(scenario: Scenario) -> str:
    """Return the input file of a scenario: every reference jumps from 0."""
    names = sorted({name for _, name, _ in scenario.references})
    now = dict.fromkeys(names, 0.0)
    lines = [",".join(["time", *(f"controller.{name}" for name in names)])]
    for time, name, number in sorted(scenario.references):
        for value in (now[name], number):
            now[name] = value
            lines.append(",".join(repr(x) for x in (time, *now.values())))
    return "\n".join(lines) + "\n"


@cache
def reference(scenario: Scenario, communication_step: float | None, delay: float) -> Solution:
    """Return the reference solution, computed once."""
    return solve(scenario, communication_step=communication_step, delay=delay)


def yardstick(scenario: Scenario, scheme: Scheme, step_size: float) -> Solution:
    """Return the reference with the ticks of a communication step, and with Jacobi's delay from sample to voltage."""
    fits = abs(SAMPLE_TIME / step_size - round(SAMPLE_TIME / step_size)) < 1e-6
    return reference(scenario, None if fits else step_size, step_size if scheme.coupling == "jacobi" else 0.0)


def pitch_error(
    robot: Path, scenario: Scenario, scheme: Scheme, step_size: float, exact: Solution | None = None
) -> float:
    """Return the largest difference [deg] of the pitch over all rows of the co-simulation."""
    exact = exact or yardstick(scenario, scheme, step_size)
    table = cosimulate(robot, scenario, scheme, step_size)
    return float(np.degrees(np.max(np.abs(table["plant.pitch"] - exact.at(step_size, PITCH)))))


def inner_step_error(robot: Path, scenario: Scenario, step_size: float) -> float:
    """Return by how much [deg] the pitch changes when the plant's inner step is refined to 25 us."""
    coarse, fine = (cosimulate(robot, scenario, SCHEMES[DEFAULT], step_size, inner) for inner in (None, 2.5e-5))
    return float(np.degrees(np.max(np.abs(coarse["plant.pitch"] - fine["plant.pitch"]))))


INNER = "of which the plant's inner step"
Row = tuple[str, str, float, float]
"""Scenario, scheme or `INNER`, communication step in s, error of the pitch in deg."""


def sweep(robot: Path) -> Iterator[Row]:
    """Yield the error of every scenario, scheme and communication step."""
    for name, scenario in SCENARIOS.items():
        for label, scheme in SCHEMES.items():
            for step_size in STEPS:
                yield name, label, step_size, pitch_error(robot, scenario, scheme, step_size)
        for step_size in STEPS:
            yield name, INNER, step_size, inner_step_error(robot, scenario, step_size)


def stored() -> dict[tuple[str, str, float], float]:
    """Return the errors [deg] that were last measured by `benchmarks/coupling.py`."""
    with STORED.open(newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))[1:]
    return {(scenario, scheme, float(step)): float(error) for scenario, scheme, step, error in rows}


def markdown(errors: dict[tuple[str, str, float], float]) -> str:
    """Return the table of the documentation."""
    lines = [
        "| communication step | " + " | ".join(f"{1e3 * h:g} ms" for h in STEPS) + " |",
        "|---|" + "---:|" * len(STEPS),
    ]
    for name in SCENARIOS:
        lines.append(f"| **{name}** |" + " |" * len(STEPS))
        for label in (*SCHEMES, INNER):
            lines.append(f"| {label} | " + " | ".join(f"{1e3 * errors[name, label, h]:.3g}" for h in STEPS) + " |")
    return "\n".join(lines)
