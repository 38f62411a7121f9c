"""Times of a log: whole nanoseconds since the start of the run."""

import math

import numpy as np
from numpy.typing import NDArray

from ...errors import TwipError

NANOSECOND = 1e-9
"""In s."""
LONGEST = 2.0**63 * NANOSECOND
"""First duration in s that is too long: readers keep nanoseconds in 64 bits with a sign."""


class LogTimes:
    """Turns times in s into the nanoseconds of the log called `log`, which begins at `start` in s."""

    def __init__(self, log: str, start: float) -> None:
        self.log = log
        self.start = start
        self.shared: float | None = None
        """Time in s of the first row that has the nanosecond of an earlier one, as steps of variable size may have."""
        self._last = 0
        self._latest = math.inf  # time of the last row in s

    def check(self, start: float, stop: float, step_size: float) -> None:
        """Refuse times in s that the log cannot keep, before a run. Raises `TwipError` with a line per problem."""
        problems = []
        if step_size < NANOSECOND:
            problems.append(
                f"log {self.log!r}: step size {step_size!r} s is below 1e-09 s, the resolution of its times: "
                f"{max(2.0, NANOSECOND / step_size):.3g} rows would share one"
            )
        if not stop - start < LONGEST:
            problems.append(
                f"log {self.log!r}: from {start!r} s to {stop!r} s is longer than the {LONGEST:.10g} s "
                "that its times reach, 2^63 nanoseconds"
            )
        if problems:
            raise TwipError(problems)

    def of_rows(self, times: NDArray[np.float64]) -> NDArray[np.uint64]:
        """Return the nanoseconds of the next rows at `times` (n,) in s. Raises `TwipError` for times out of order."""
        exact = np.rint((times - self.start) * 1e9)
        # Comparisons with NaN are false, so these also refuse it.
        ordered = not len(exact) or (
            exact[0] >= self._last and exact[-1] < 2.0**63 and bool((exact[1:] >= exact[:-1]).all())
        )
        if not ordered:
            raise TwipError(
                f"log {self.log!r}: times from {times[0]} s to {times[-1]} s must be finite, "
                f"must not decrease and must not lie before {self.start + self._last / 1e9} s"
            )
        if self.shared is None:
            shared = (np.diff(times, prepend=self._latest) > 0.0) & (np.diff(exact, prepend=self._last) == 0.0)
            self.shared = float(times[shared.argmax()]) if shared.any() else None
        if len(exact):
            self._last, self._latest = int(exact[-1]), float(times[-1])
        return exact.astype(np.uint64)

    def of_event(self, time: float) -> int:
        """Return the nanoseconds of a message at `time` in s, those of the last row if it is not finite."""
        return max(0, round((time - self.start) * 1e9)) if math.isfinite(time) else self._last
