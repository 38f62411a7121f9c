"""A block behind pythonfmu3, as an FMI 3.0 co-simulation FMU.

pythonfmu3 0.3.4 never passes on the start time: the first step tells it. If it is not 0, the initialization is done
once more with what was set when initialization mode was left.
"""

from collections.abc import Sequence
from typing import Any

from pythonfmu3 import Fmi3Slave, Fmi3Status, Fmi3StepResult

from .messages import ERROR
from .slave import BlockSlave


class BlockSlave3(BlockSlave, Fmi3Slave):  # type: ignore[misc]
    """One instance of a block in FMI 3.0."""

    binaries = "x86_64-linux"
    logs_formats = False
    refusal = ERROR

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self._initial: list[float] | None = None  # what was set when initialization mode was left, until the first step

    def exit_initialization_mode(self) -> None:
        """Check the parameters and compute the values at the start time."""
        super().exit_initialization_mode()
        self._initial = list(self._table.all_values(self._values))

    def do_step(self, current_time: float, step_size: float) -> Any:
        """Advance from `current_time` by `step_size` (both s).

        Return False, FMI's Discard, when the step failed, and FMI's Error when it was not tried: no other step would
        be, until the instance is reset or an earlier state restored (FMI 3.0.1 section 2.2.3).
        """
        if self._initial is not None:
            if current_time != self._start_time:
                self._start_at(current_time, self._initial)
            self._initial = None
        done = super().do_step(current_time, step_size)
        return Fmi3StepResult(Fmi3Status.error) if self._refused and not done else done

    def _start_at(self, time: float, initial: list[float]) -> None:
        """Initialize again at another start time, and bring back what was set since."""
        values = self._values
        settable = [v.attribute for v in self._table.variables.values() if v.causality in ("input", "parameter")]
        newest = [getattr(values, attribute) for attribute in settable]
        for attribute, value in zip(self._table.attributes, initial, strict=True):
            setattr(values, attribute, value)
        self._start_time, self._stale = time, True
        self._refresh()
        if self._failure:
            self._fail(f"initialization failed\n{self._failure}")
        for attribute, value in zip(settable, newest, strict=True):
            setattr(values, attribute, value)

    def get_float64(self, vrs: Sequence[int]) -> list[float]:
        """Return Float64 values by value reference; the one after the block's own is time."""
        time = len(self._table.variables)
        if time not in vrs:
            return self.get_real(vrs)
        return [self._block.reached[0] if vr == time else self.get_real([vr])[0] for vr in vrs]

    set_float64 = BlockSlave.set_real
    get_int32, set_int32 = BlockSlave.get_integer, BlockSlave.set_integer

    def _get_fmu_state(self) -> dict[str, Any]:
        return {**super()._get_fmu_state(), "time": self._block.reached[0], "initial": self._initial}

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        super()._set_fmu_state(state)
        if isinstance(state, dict) and "initial" in state:
            self._block.reached[0], self._initial = state["time"], state["initial"]
