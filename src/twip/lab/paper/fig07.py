"""Fig 7: pitch by the accelerometer alone, both forms of eq (41), against the real pitch."""

import numpy as np

from ..drawing import ORANGE, RED, picture
from ..numbers import fundamental, phase_lag
from .checks import Check, Result
from .laboratory import Laboratory
from .swing import FAST, FAST_FREQUENCY, SLOW, draw_estimates, encoder_pitch, swings

CLOSE = 1.0
"""An estimate is close to the real pitch when its rms error stays below, in degrees."""


def run(laboratory: Laboratory) -> Result:
    """Swing the body with the wheels locked: slowly, then fast."""
    swung = swings(laboratory)
    slow, fast = swung.errors("pitch_arctan", SLOW), swung.errors("pitch_arctan", FAST)
    slow_sine, fast_sine = swung.errors("pitch_arcsin", SLOW), swung.errors("pitch_arcsin", FAST)
    lags, ratios, offsets = [], [], []
    for recorded in swung.runs:
        part = recorded.during(*FAST)
        estimate, real = part["estimator.pitch_arctan"], encoder_pitch(part)
        lags.append(phase_lag(part.times, estimate, real, FAST_FREQUENCY))
        amplitudes = [abs(fundamental(part.times, signal, FAST_FREQUENCY)) for signal in (estimate, real)]
        ratios.append(amplitudes[0] / amplitudes[1])
        offsets.append(float(np.degrees(np.max(np.abs(encoder_pitch(recorded) - recorded["plant.pitch"])))))
    half_count = 180.0 / 2048 / 13.7
    checks = (
        Check("Fig 7", "the encoder shows the real pitch when the wheels are fixed",
              "largest difference between encoder and plant",
              offsets, 0.0, 1.05 * half_count, "°", "half an encoder count, 0.0064°", max(offsets) < CLOSE),
        Check("Fig 7", "ψ_acc is close to ψ_real when the pitch varies slowly", "rms error, arctan, 0.2 Hz, 20°",
              slow, 0.25, 0.60, "°", "prototype 0.49°; the biases alone make 0.29°", max(slow) < CLOSE),
        Check("Fig 7", "the other form of eq (41) does the same", "rms error, arcsin, 0.2 Hz, 20°",
              slow_sine, 0.25, 0.65, "°", "the arctan's 0.49°", max(slow_sine) < CLOSE),
        Check("Fig 7", "the amplitude of ψ_acc is not close when the pitch changes quickly",
              "rms error, arctan, 3 Hz, 12°",
              fast, 24.5, 27.5, "°", "prototype 25.9°", min(fast) > CLOSE),
        Check("Fig 7", "", "rms error, arcsin, 3 Hz, 12°", fast_sine, 30.0, 37.0, "°",
              "arcsin(4.1 sin 12°) = 59°: (59° − 12°)/√2",
              min(fast_sine) > CLOSE),
        Check("Fig 7", "", "amplitude of ψ_acc over that of ψ_real, 3 Hz", ratios, 3.0, 4.2, "",
              "1 + L_s sin β Ω² / g = 4.1, less by the arctan", min(ratios) > 1.5),
        Check("Fig 7", "the phases of ψ_acc are almost the same as those of ψ_real", "phase lag, 3 Hz",
              lags, -3.0, 3.0, "°", "the lever arm's force is in phase with the pitch", max(map(abs, lags)) < 10.0),
    )  # fmt: skip
    first = swung.runs[0]
    with picture(laboratory.out / "fig07.png", "Fig 7: pitch by the accelerometer alone", (2.6, 2.6)) as (left, right):
        for axes, (begin, end), words in (
            (left, SLOW, "slow, 0.2 Hz"),
            (right, (FAST[0], FAST[0] + 2.0), "fast, 3 Hz"),
        ):
            part = first.during(begin, end)
            draw_estimates(
                axes,
                part,
                ("pitch_arctan", "accelerometer, arctan", RED, "-"),
                ("pitch_arcsin", "accelerometer, arcsin", ORANGE, "--"),
            )
            axes.set_title(words)
            axes.set_xlim(begin, min(end, part.times[-1]))
    return Result("fig07", "Pitch by the accelerometer alone", checks, (swung.experiment.command(),))
