"""Runs a block behind pythonfmu or pythonfmu3: values, modes, errors and state of one FMU instance.

pythonfmu has no way to return an error from a setter or from initialization. It turns an exception into fmi2Fatal,
which forbids the host any further call to any instance (FMI 2.0.4 section 2.1.3), fmi2Reset too: far too much for a
mistyped parameter. So nothing here raises: a wrong value is refused and logged in the call that brings it, the mistake
is kept, and every step fails until the instance is reset or a state from before the mistake is restored.
"""

import sys
import traceback
from collections.abc import Callable, Sequence
from math import inf, isfinite
from typing import Any, ClassVar

from ..robot.kernel import ENTERED, NOT_FINITE, OPEN, WAITING
from .declare import Block
from .exit_guard import guard_exit
from .messages import LOG_CATEGORIES, WARNING, Messages
from .saved_state import state_from_bytes, state_to_bytes, why_not_restorable
from .table import NATIVE_REFERENCE, Table, out_of_bounds, shown
from .values import new_values

INSTANTIATED, INITIALIZATION, STEPPING, TERMINATED = range(4)
"""Modes of an instance (FMI 2.0.4, section 4.2.4)."""


class BlockSlave:
    """One instance of a block, for a class of pythonfmu to be mixed in.

    A subclass names the folder of its `binaries`, whether its log takes C formats, and the status that refuses a step
    because of an earlier mistake; one of that, the `block` and the `fingerprint` of its sources.
    """

    binaries: ClassVar[str]
    logs_formats: ClassVar[bool]
    refusal: ClassVar[int]
    block: ClassVar[Block]
    fingerprint: ClassVar[str]
    log_categories = LOG_CATEGORIES
    _table: ClassVar[Table]
    log_queue: list[Any]
    resources: str | None

    def __init_subclass__(cls) -> None:
        if "block" in vars(cls):
            cls._table = Table(cls.block)

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.modelName = self.block.name
        self._block = new_values(self._table)
        self._values = self._block.v
        self._advance = self._block.advance
        self._mode = INSTANTIATED
        self._start_time = 0.0
        self._messages = Messages(self.log_queue, self.logs_formats)
        if self._table.why_plain:
            self._messages.log(WARNING, f"the block runs uncompiled: {self._table.why_plain}")
        self._failure = ""  # traceback of the latest initialization
        self._stale = True  # initialization must run before outputs are read
        self._gate = self._block.gate
        self._gate[0] = WAITING  # the next step has something to check first
        self._unchecked = True  # parameters have changed since they were checked
        self._warned = False
        self._refused = False  # the latest step was not tried, because of an earlier mistake
        self._asked: list[int] = []  # value references of the last get, and how to read them at once
        self._read: Callable[[], list[float]] = list
        self._writers: dict[
            tuple[int, ...], Callable[[Sequence[float]], bool]
        ] = {}  # while stepping: inputs set together
        if self.resources:
            guard_exit(self.resources, self.binaries, self.block.name)
            while sys.path.count(self.resources) > 1:  # pythonfmu adds it again for every instance
                sys.path.remove(self.resources)

    # Modes

    def setup_experiment(self, start_time: float, *_: Any) -> None:
        """Take the start time in s."""
        self._start_time = start_time
        self._stale = True

    def enter_initialization_mode(self) -> None:
        """Let outputs follow inputs and parameters until initialization is complete."""
        self._mode = INITIALIZATION

    def exit_initialization_mode(self) -> None:
        """Check the parameters and compute the values at the start time."""
        self._mode = STEPPING
        self._refresh()
        if self._check_parameters() and self._failure:
            self._fail(f"initialization failed\n{self._failure}")
        elif not self._messages.errors:
            self._check_outputs("after initialization")

    def terminate(self) -> None:
        """End the run; values stay readable."""
        self._mode = TERMINATED
        self._writers.clear()
        self._gate[0] = WAITING

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Advance from `current_time` by `step_size` (both s); return False, FMI's Discard, if that failed."""
        try:
            if (self._gate[0] != OPEN or not 0.0 < step_size < inf) and not self._ready(current_time, step_size):
                return False
            if not self._advance(current_time, step_size):
                return self._check_outputs(f"after the step from {current_time:.10g} s by {step_size:.10g} s")
        except BaseException:
            self._fail(f"the step from {current_time!r} s by {step_size!r} s failed\n{traceback.format_exc()}")
            return False
        return True

    # Values

    def get_real(self, vrs: Sequence[int]) -> list[float]:
        """Return Real values by value reference."""
        try:
            if self._stale:
                self._refresh()
            if vrs != self._asked:
                if not vrs or not all(vr in self._table.names["Real"] for vr in vrs):
                    return self._get(vrs, "Real")
                self._asked, self._read = list(vrs), self._block.reader(vrs)
            return self._read()
        except BaseException:
            return [float(x) for x in self._get(vrs, "Real")]

    def get_integer(self, vrs: Sequence[int]) -> list[int]:
        """Return Integer values by value reference."""
        return [int(x) if isfinite(x) else 0 for x in self._get(vrs, "Integer")]

    def get_boolean(self, vrs: Sequence[int]) -> list[bool]:
        """Return Boolean values by value reference."""
        return [x != 0.0 for x in self._get(vrs, "Boolean")]

    def get_string(self, vrs: Sequence[int]) -> list[str]:
        """Return where the values and the native step are; there are no other String variables."""
        if list(vrs) == [NATIVE_REFERENCE]:
            return [" ".join(map(str, self._block.native))]
        self._get(vrs, "String")
        return [""] * len(vrs)

    def set_real(self, vrs: Sequence[int], values: Sequence[float]) -> None:
        """Set Real inputs and parameters by value reference."""
        try:
            write = self._writers.get(tuple(vrs))
            if write is not None and write(values):
                return
            for vr, value in zip(vrs, values, strict=False):
                self._set(vr, value, "Real")
            if write is None and vrs and self._mode == STEPPING and self._table.inputs.issuperset(vrs):
                self._writers[tuple(vrs)] = self._block.writer(vrs)
        except BaseException:
            self._fail(f"setting Real variables failed\n{traceback.format_exc()}")

    def set_integer(self, vrs: Sequence[int], values: Sequence[int]) -> None:
        """Set Integer parameters by value reference."""
        for vr, value in zip(vrs, values, strict=False):
            self._set(vr, float(value), "Integer")

    def set_boolean(self, vrs: Sequence[int], values: Sequence[bool]) -> None:
        """Set Boolean parameters by value reference."""
        for vr, value in zip(vrs, values, strict=False):
            self._set(vr, 1.0 if value else 0.0, "Boolean")

    def set_string(self, vrs: Sequence[int], _values: Sequence[str]) -> None:
        """Refuse: blocks have no String variables."""
        for vr in vrs:
            self._fail(f"value reference {vr} is no String variable of block {self.block.name}")

    def _get(self, vrs: Sequence[int], kind: str) -> list[float]:
        if self._stale:
            self._refresh()
        names = self._table.names.get(kind, {})
        for vr in vrs:
            if vr not in names:
                self._fail(f"value reference {vr} is no {kind} variable of block {self.block.name}")
        return [getattr(self._values, names[vr]) if vr in names else 0.0 for vr in vrs]

    def _set(self, vr: int, value: float, kind: str) -> None:
        variable = self._table.variables.get(vr)
        if variable is None or variable.type != kind:
            self._fail(f"value reference {vr} is no {kind} variable of block {self.block.name}")
        elif variable.causality not in ("input", "parameter"):
            self._fail(f"{variable.name} cannot be set: its causality is {variable.causality}")
        elif not isfinite(value):
            self._fail(f"{variable.name} = {shown(variable, value)} must be finite")
        elif variable.causality == "parameter" and (problem := out_of_bounds(variable, value)):
            self._fail(problem)
        elif self._mode == TERMINATED:
            self._fail(f"{variable.name} cannot be set after termination")
        elif self._mode == STEPPING and variable.causality == "parameter" and variable.variability != "tunable":
            self._fail(f"{variable.name} is a fixed parameter: it cannot be set after initialization")
        else:
            setattr(self._values, variable.attribute, value)
            if self._mode != STEPPING:
                self._stale = True
            if variable.causality == "parameter":
                self._unchecked = True
                self._gate[0] = WAITING

    # Checks

    def _refresh(self) -> None:
        """Run the block's initialization if anything it depends on has changed.

        An exception waits for the end of initialization mode: parameters are often set one by one.
        """
        if not self._stale:
            return
        self._stale = False
        self._failure = ""
        self._table.clear(self._values)
        try:
            if not self._table.broken_rules(self._values):
                self._block.initialize(self._start_time)
        except BaseException:
            self._failure = traceback.format_exc()

    def _ready(self, time: float, step_size: float) -> bool:
        """Return whether a step may be done; otherwise the reason is in the log."""
        when = f"the step from {time:.10g} s by {step_size:.10g} s"
        self._refused = False
        if self._gate[0] == NOT_FINITE:
            return self._check_outputs(f"after {when}")
        if self._gate[0] == ENTERED:
            self._advance(time, step_size)  # raises what could not leave the native step
        elif self._mode != STEPPING:
            self._fail("a step is possible only between initialization and termination")
        elif not (0.0 < step_size < inf and isfinite(time)):
            self._fail(f"the step from {time!r} s by {step_size!r} s needs a finite begin and a positive length")
        elif self._unchecked:
            self._check_parameters()
        if self._messages.errors:
            reasons = "; ".join(e.split("\n", 1)[0] for e in self._messages.errors)
            self._refused = True
            self._messages.log(self.refusal, f"no step from {time:.10g} s, because of: {reasons}")
            return False
        self._warn_of_sampling(step_size)
        self._gate[0] = OPEN
        return True

    def _check_parameters(self) -> bool:
        self._unchecked = False
        try:
            problems = self._table.broken_rules(self._values)
        except BaseException:
            problems = [f"the check of the parameters failed\n{traceback.format_exc()}"]
        for problem in problems:
            self._fail(problem)
        return not problems

    def _check_outputs(self, when: str) -> bool:
        pairs = [(variable, getattr(self._values, variable.attribute)) for variable in self._table.outputs]
        wrong = [(variable, value) for variable, value in pairs if not isfinite(value)]
        for variable, value in wrong:
            self._fail(f"{variable.name} = {shown(variable, value)} {when} must be finite")
        return not wrong

    def _warn_of_sampling(self, step_size: float) -> None:
        """Say once when ticks fall between communication points."""
        if self._warned:
            return
        self._warned = True
        for name in ("sample_time", "sample_offset"):
            steps = getattr(self._values, name, 0.0) / step_size
            if abs(steps - round(steps)) > 1e-9 * max(1.0, steps):
                self._messages.log(
                    WARNING,
                    f"{name} = {getattr(self._values, name):.10g} s is not a multiple of the step {step_size:.10g} s: "
                    "a sample is taken in the first step that reaches it",
                )

    # State

    def _get_fmu_state(self) -> dict[str, Any]:
        return {
            "block": self.block.name,
            "fingerprint": self.fingerprint,
            "mode": self._mode,
            "start_time": self._start_time,
            "flags": [self._stale, self._unchecked, self._warned],
            "failure": self._failure,
            "errors": list(self._messages.errors),
            "values": list(self._table.all_values(self._values)),
        }

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        try:
            size = len(self._table.attributes)
            problem = why_not_restorable(state, self.block.name, self.fingerprint, size)
            if problem:
                self._fail(problem)
                return
            for attribute, value in zip(self._table.attributes, state["values"], strict=True):
                setattr(self._values, attribute, value)
            self._mode = state["mode"]
            self._writers.clear()
            self._start_time = state["start_time"]
            self._stale, self._unchecked, self._warned = state["flags"]
            self._failure = state["failure"]
            self._messages.errors[:] = state["errors"]
            self._gate[0] = WAITING
        except BaseException:
            self._fail(f"restoring a state failed\n{traceback.format_exc()}")

    _fmu_state_to_bytes = staticmethod(state_to_bytes)
    _fmu_state_from_bytes = staticmethod(state_from_bytes)

    def _fail(self, error: str) -> None:
        """Log an error; every step fails until reset, or until a state from before is restored."""
        self._gate[0] = WAITING
        self._messages.fail(error)
