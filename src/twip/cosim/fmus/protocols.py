"""What a run needs of an FMU instance, whether it lives in this process (`component`, `ports`) or in one of its own
(`isolation`).
"""

from collections.abc import Sequence
from typing import Protocol

from ..values.written import StartValue


class AnyInstance(Protocol):
    """The life cycle of an instance; what fails raises `ComponentError`."""

    name: str

    def setup(self, start_time: float, stop_time: float) -> None:
        """Apply the start values and enter initialization mode."""

    def finish_initialization(self) -> None:
        """Leave initialization mode: the instance may be stepped."""

    def set_value(self, start: StartValue) -> None:
        """Set a variable before initialization, or a tunable parameter between two steps."""

    def step(self, time: float, step_size: float) -> None:
        """Advance from `time` by `step_size`, both in s."""

    def save_state(self) -> bytes:
        """Return the serialized state between two steps."""

    def restore_state(self, data: bytes) -> None:
        """Take over a state that `save_state` of an instance of the same FMU has returned."""

    def expect_rollback(self) -> None:
        """Be ready to be put back to a time before the last step's beginning."""

    def keep_state(self) -> int:
        """Return what stands for the state between two steps in `return_to`; it must be freed."""

    def return_to(self, state: int) -> None:
        """Be where `keep_state` returned `state`."""

    def free_state(self, state: int) -> None:
        """Free what `keep_state` has returned."""

    def close(self) -> None:
        """Terminate and free; failures here are only logged."""


class AnyPorts(Protocol):
    """Moves values between the value vector and an instance; what fails raises `ComponentError`.

    Between `set_inputs` or the `step` of the instance and the next `get_outputs` the vector must stay as it is: an
    isolated instance does all three at once.
    """

    def read_inputs(self) -> None:
        """Read the inputs' start values from the FMU into the vector; they count as set."""

    def set_inputs(self) -> None:
        """Set the inputs that changed since they were last set."""

    def forget_inputs(self) -> None:
        """Set all inputs next time: the instance has been put back."""

    def get_some(self, columns: Sequence[int]) -> None:
        """Read the outputs with these columns into the vector."""

    def ask_outputs(self) -> None:
        """Announce that `get_outputs` comes next, so that an instance of its own process begins with what is due."""

    def get_outputs(self) -> None:
        """Read all outputs into the vector."""

    @property
    def instance(self) -> AnyInstance:
        """The instance."""
