"""What a bench's instruments make of the truth: the current's sensor and the encoder.

The blocks compute the exact current and the encoder's count; a real bench sees the current through a shunt and an
analogue-to-digital converter. This is the measurement model of the simulated experiments, applied while they are
logged: zero offset and white noise on the current, both then rounded to the converter's step; an encoder whose zero
lies anywhere between two counts. Assumed: a converter of the INA219 class with a shunt of 0.1 Ohm.
"""

from math import pi

import numpy as np

from ...cosim import Channel, Signal, Sink
from ...robot import value
from .recording import Array

CHANNEL = Channel(
    "sensor",
    (
        Signal("current", "Real", "A", "output", "measured motor current"),
        Signal("encoder_count", "Real", None, "output", "counted encoder steps"),
    ),
)


class Sensor:
    """One bench's instruments; the same seed gives the same readings.

    noise: standard deviation of one current reading [A]; resolution: step of the current's converter [A]; zero:
    standard deviation of the current's offset from bench to bench [A]; encoder_resolution: counts per revolution.
    """

    def __init__(
        self,
        seed: int,
        noise: float = 1e-3,
        resolution: float = 1e-4,
        zero: float = 5e-4,
        encoder_resolution: float = value("encoder_resolution"),
    ):
        self.noise, self.resolution, self.encoder_resolution = noise, resolution, encoder_resolution
        self._generator = np.random.default_rng(seed)
        self._offset = zero * self._generator.standard_normal()
        self._phase = self._generator.random()

    def read(self, current: Array, angle: Array) -> tuple[Array, Array]:
        """Return readings of the current [A] and counts [1] for true currents [A] and shaft angles [rad], all (n,)."""
        disturbed = current + self._offset + self.noise * self._generator.standard_normal(len(current))
        counts = np.floor(angle * self.encoder_resolution / (2.0 * pi) + self._phase)
        return self.resolution * np.round(disturbed / self.resolution), counts


class MeasuredSink:
    """Passes rows on to a sink with the readings of a sensor as two further columns, in the order of `CHANNEL`."""

    def __init__(self, sink: Sink, sensor: Sensor, current_column: int, angle_column: int):
        self._sink, self._sensor = sink, sensor
        self._current, self._angle = current_column, angle_column

    def write(self, times: Array, rows: Array) -> None:
        """Measure and pass on."""
        readings = self._sensor.read(rows[:, self._current], rows[:, self._angle])
        self._sink.write(times, np.column_stack([rows, *readings]))

    def event(self, time: float, level: str, source: str, message: str) -> None:
        """Pass on a message."""
        self._sink.event(time, level, source, message)

    def close(self) -> None:
        """Close the sink."""
        self._sink.close()
