"""Options of a run as the command line names them, one by one, for tests that pass them through."""

from dataclasses import fields
from typing import Any

from twip.cosim import Algorithm, Checkpoints, Inputs, Observer, Runtime

GROUPS = {
    "algorithm": Algorithm,
    "inputs": Inputs,
    "runtime": Runtime,
    "checkpoints": Checkpoints,
    "observer": Observer,
}
OTHER_NAMES = {"input_file": "file", "checkpoint": "file", "checkpoint_every": "every"}
"""Where a field has a shorter name than the option."""


def _group(option: str) -> str | None:
    if option in ("checkpoint", "checkpoint_every"):
        return "checkpoints"
    if option == "input_file":
        return "inputs"
    return next((name for name, group in GROUPS.items() if option in {f.name for f in fields(group)}), None)


def grouped(**options: Any) -> dict[str, Any]:
    """Return the arguments of `simulate` for some options; times, step and sinks stay as they are."""
    arguments, groups = {}, {}
    for option, value in options.items():
        if (name := _group(option)) is None:
            arguments[option] = value
        else:
            groups.setdefault(name, {})[OTHER_NAMES.get(option, option)] = value
    return arguments | {name: GROUPS[name](**values) for name, values in groups.items()}
