"""One component's recorded outputs as an FMU."""

from pathlib import Path

import numpy as np

from ..cosim import Playback, read_log
from ..errors import TwipError
from ..fmi import Recording, Variable, write_replay
from .remarks import cut_off

KINDS = {"Real": "Real", "Float32": "Real", "Boolean": "Boolean"} | dict.fromkeys(
    ("Integer", "Int8", "UInt8", "Int16", "UInt16"), "Integer"
)
"""Recorded types that FMI 2.0 holds, and what they become."""


def replay(log: Path, component: str, output: Path, linear: bool = False) -> list[str]:
    """Write an FMU that plays the outputs of `component` in `log`; return what it leaves out, a sentence each.

    `linear`: Real signals are linear between rows instead of held. Raises TwipError when the log cannot be read, knows
    no such component, or has no outputs of it.
    """
    record = read_log(log)
    channels = {c.component: c for c in record.channels}
    if component not in channels:
        raise TwipError(f"{log}: there is no component {component!r}; there are {', '.join(filter(None, channels))}")
    outputs = [s for s in channels[component].signals if s.causality == "output"]
    left_out = [f"{component}.{s.name}: FMI 2.0 has no output of type {s.type}" for s in outputs if s.type not in KINDS]
    kept = [s for s in outputs if s.type in KINDS]
    if not kept or not len(record.times):
        raise TwipError(f"{log}: there is no row with outputs of {component}")
    variables = tuple(
        Variable(
            s.name,
            "output",
            "continuous" if linear and KINDS[s.type] == "Real" else "discrete",
            KINDS[s.type],
            s.unit,
            description=s.description or f"recorded {s.name}",
        )
        for s in kept
    )
    columns = tuple(_numbers(record, f"{component}.{s.name}") for s in kept)
    text = f"Outputs of {component}, played from {log.name}"
    write_replay(Recording(output.stem, text, variables, record.times.tolist(), columns), output)
    return [missing for missing in (cut_off(record), *left_out) if missing]


def _numbers(record: Playback, name: str) -> list[float]:
    numbers: list[float] = np.asarray(record[name], np.float64).tolist()
    return numbers
