"""Runs the blocks as plain Python, without any FMU: for tests, and to make the reference runs anew."""

import csv
import importlib.util
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

from twip.fmi.declare import Block
from twip.robot.parameters import value

FMUS = Path(__file__).resolve().parents[2] / "fmus"


def load(name: str) -> ModuleType:
    """Return the face of a block, `fmus/<name>/<name>.py`, as a module of its own."""
    spec = importlib.util.spec_from_file_location(f"face_{name}", FMUS / name / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def instance(block: Block, **values: float) -> Any:
    """Return an object with all variables of a block: start values, others 0, and `values` by attribute."""
    v = SimpleNamespace(**{x.attribute: float(x.start or 0.0) for x in block.variables})
    for attribute, number in values.items():
        assert hasattr(v, attribute), f"{block.name} has no {attribute}"
        setattr(v, attribute, float(number))
    return v


def started(block: Block, time: float = 0.0, **values: float) -> Any:
    """Return an initialized instance."""
    v = instance(block, **values)
    block.initialize(v, time)
    return v


def nominal_friction(static: float = 1.0) -> dict[str, float]:
    """Return the friction inputs that the nominal motors give the plant, static friction times `static`."""
    levels = {
        f"{side}_{kind}_{way}_limit": value(f"{side}.coulomb_{way}") * (static if kind == "static" else 1.0)
        for side in ("left", "right")
        for kind in ("coulomb", "static")
        for way in ("forward", "reverse")
    }
    return levels | {f"{side}_stribeck_speed_limit": value("stribeck_speed") for side in ("left", "right")}


def names(block: Block, causality: str) -> list[str]:
    """Return the names of a block's variables of one causality, in order."""
    return [v.name for v in block.variables if v.causality == causality]


def interpolate(rows: list[dict[str, float]], time: float) -> dict[str, float]:
    """Return the inputs at a time [s]: linear between rows, constant outside, the last of rows at the same time."""
    after = next((i for i, row in enumerate(rows) if row["time"] > time), len(rows))
    if after == 0 or after == len(rows):
        return rows[max(after - 1, 0)]
    a, b = rows[after - 1], rows[after]
    share = (time - a["time"]) / (b["time"] - a["time"])
    return {name: a[name] + share * (b[name] - a[name]) for name in a}


def simulate(
    block: Block, v: Any, rows: list[dict[str, float]], step_size: float, steps: int, start: float = 0.0
) -> Iterator[dict[str, float]]:
    """Yield `time` and all outputs at the start and after each step; inputs at its beginning are set before a step."""
    outputs = [x for x in block.variables if x.causality == "output"]

    def feed(time: float) -> None:
        for name, number in interpolate(rows, time).items():
            if name != "time":
                setattr(v, name.replace(".", "_"), number)

    feed(start)
    block.initialize(v, start)
    yield {"time": start, **{x.name: getattr(v, x.attribute) for x in outputs}}
    for k in range(steps):
        time = start + k * step_size
        feed(time)
        block.step(v, time, step_size)
        yield {"time": start + (k + 1) * step_size, **{x.name: getattr(v, x.attribute) for x in outputs}}


def read(path: Path) -> list[dict[str, float]]:
    """Return the rows of a CSV file as numbers by column name."""
    with path.open(newline="") as file:
        return [{name: float(text) for name, text in row.items()} for row in csv.DictReader(file)]


def write(path: Path, rows: Iterable[dict[str, float]]) -> None:
    """Write rows to a CSV file; every number reads back exactly."""
    rows = list(rows)
    with path.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(rows[0])
        writer.writerows([repr(float(x)) for x in row.values()] for row in rows)


def regenerate(name: str) -> None:
    """Write `fmus/<name>/output.csv` from its `input.csv`: all defaults, up to the last row's time."""
    block = load(name).BLOCK
    rows = read(FMUS / name / "input.csv")
    steps = round(rows[-1]["time"] / block.step_size)
    write(FMUS / name / "output.csv", simulate(block, instance(block), rows, block.step_size, steps))


if __name__ == "__main__":
    for block_name in sys.argv[1:]:
        regenerate(block_name)
