"""Options that say how the components of a system are coupled."""

import argparse
from collections.abc import Sequence
from typing import Any

from ...cosim import COUPLING_OPTIONS, COUPLINGS, DEFAULT_COUPLING, couplings_that
from ...errors import TwipError


def declare_coupling(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument(
        "--coupling", choices=tuple(COUPLINGS), help=f"default: the system's, else {DEFAULT_COUPLING.name}"
    )
    parser.add_argument(
        "--mid-step",
        nargs="*",
        action="extend",
        metavar="NAME",
        help="inputs (component.variable) that are taken at the middle of each step, none without names; "
        "default: the system's, unless --coupling is given",
    )
    parser.add_argument(
        "--order",
        nargs="*",
        action="extend",
        metavar="NAME",
        help=f"all components in the order of execution under {couplings_that(lambda a: a.takes_order)}, "
        "none for that of their feed-through; default: the system's, unless --coupling is given",
    )
    parser.add_argument(
        "--own-step",
        nargs="*",
        action="extend",
        metavar="NAME=S",
        help="components with a step of their own in s, a whole multiple of --step-size, none without names; "
        "default: the system's",
    )
    for option in COUPLING_OPTIONS.values():
        parser.add_argument(
            f"--{option.name.replace('_', '-')}", type=option.kind, metavar=option.metavar, help=option.help
        )
    parser.add_argument(
        "--tolerance",
        type=float,
        metavar="X",
        help="variable steps, the first of --step-size: largest local error per step, relative to magnitude or nominal "
        "value; 0 for equal steps; default: the system's, else 0",
    )
    parser.add_argument(
        "--minimum-step",
        type=float,
        metavar="S",
        help="smallest variable step in s; default: the system's, else a millionth of the first",
    )
    parser.add_argument(
        "--maximum-step", type=float, metavar="S", help="largest variable step in s; default: the system's, else none"
    )


def coupling_options(arguments: argparse.Namespace) -> dict[str, Any]:
    """Return what was given, by the names that `Algorithm` has for it."""
    names = ("coupling", "tolerance", "minimum_step", "maximum_step")
    own = {name: getattr(arguments, name) for name in COUPLING_OPTIONS}
    lists = {name: getattr(arguments, name) for name in ("mid_step", "order")}
    return {
        **{name: getattr(arguments, name) for name in names},
        **{name: None if given is None else tuple(given) for name, given in lists.items()},
        "options": {name: value for name, value in own.items() if value is not None},
        "own_steps": own_steps(arguments.own_step),
    }


def own_steps(values: Sequence[str] | None) -> dict[str, float] | None:
    """Return the steps of `--own-step a=0.01 b=0.02`."""
    if values is None:
        return None
    found: dict[str, float] = {}
    for value in values:
        name, _, size = value.rpartition("=")
        try:
            step = float(size)
        except ValueError:
            step = None
        if not name or step is None:
            raise TwipError(f"--own-step {value}: must be a component and its step in s, such as {name or value}=0.01")
        if name in found:
            raise TwipError(f"--own-step: {name} is given more than once")
        found[name] = step
    return found
