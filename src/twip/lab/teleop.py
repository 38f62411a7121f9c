"""Keys that steer the robot: speed and yaw references, and a push."""

from collections.abc import Callable
from math import degrees, radians
from threading import Timer

from ..cosim import LiveInputs

SPEED, YAW, PUSH = "controller.speed_reference", "controller.yaw_reference", "plant.push_force"
SPEED_STEP, SPEED_LIMIT = 0.05, 0.5
"""Of the speed reference per key, and its largest magnitude, in m/s."""
YAW_STEP = radians(15.0)
"""Of the yaw reference per key, in rad."""
FORCE, DURATION = 10.0, 0.1
"""Of a push, in N and s."""
HELP = "↑ ↓ speed · ← → turn · space push · 0 stop · q end"


class Teleop:
    """Turns keys into inputs; `say` is told what is asked for now."""

    def __init__(self, inputs: LiveInputs, say: Callable[[str], None]) -> None:
        self._inputs = inputs
        self._say = say
        self._release: Timer | None = None

    def press(self, key: str) -> bool:
        """Take a key: `up`, `down`, `left`, `right`, or its letter. Return False when it asks for the end."""
        if key == "q":
            return False
        if key in ("up", "down"):
            self._add(SPEED, SPEED_STEP if key == "up" else -SPEED_STEP, SPEED_LIMIT)
        elif key in ("left", "right"):
            self._add(YAW, YAW_STEP if key == "left" else -YAW_STEP)
        elif key == "0":
            self._set(SPEED, 0.0)
        elif key == " ":
            self._push()
        return True

    def close(self) -> None:
        """End a push at once."""
        if self._release is not None:
            self._release.cancel()
            self._release.join()
            self._set(PUSH, 0.0)

    def _push(self) -> None:
        if self._release is not None and self._release.is_alive():
            return
        self._set(PUSH, FORCE)
        self._release = Timer(DURATION, lambda: self._set(PUSH, 0.0))
        self._release.daemon = True
        self._release.start()

    def _add(self, name: str, step: float, limit: float = float("inf")) -> None:
        if name in self._inputs.names:
            value = self._inputs[name] + step
            self._set(name, max(-limit, min(limit, 0.0 if abs(value) < 0.5 * abs(step) else value)))

    def _set(self, name: str, value: float) -> None:
        if name in self._inputs.names and self._inputs.offer(name, value):
            self._tell()

    def _tell(self) -> None:
        words = []
        if SPEED in self._inputs.names:
            words.append(f"speed {self._inputs[SPEED]:+.2f} m/s")
        if YAW in self._inputs.names:
            words.append(f"yaw {degrees(self._inputs[YAW]):+.0f}°")
        if PUSH in self._inputs.names and self._inputs[PUSH]:
            words.append(f"push {self._inputs[PUSH]:g} N")
        self._say("  ".join(words))
