"""Fig 12: pitch through a second-order low-pass of 5 Hz instead of the Kalman filter."""

from ..drawing import BLUE, ORANGE, RED, picture
from ..numbers import phase_lag
from .checks import Check, Result
from .laboratory import Laboratory
from .swing import FAST, FAST_FREQUENCY, draw_estimates, encoder_pitch, swings


def run(laboratory: Laboratory) -> Result:
    """Swing the body with the wheels locked: slowly, then fast."""
    swung = swings(laboratory)
    plain, corrected = swung.errors("pitch_low_pass", FAST), swung.errors("pitch_lever_arm_low_pass", FAST)
    kalman = swung.errors("pitch", FAST)
    lags = []
    for recorded in swung.runs:
        part = recorded.during(*FAST)
        lags.append(
            phase_lag(part.times, part["estimator.pitch_lever_arm_low_pass"], encoder_pitch(part), FAST_FREQUENCY)
        )
    ratios = [a / b for a, b in zip(corrected, kalman, strict=True)]
    checks = (
        Check("Fig 12", "a 2nd-order filter of 5 Hz is worse than the Kalman filter when the pitch changes quickly",
              "rms error on ψ_acc, 3 Hz, 12°",
              plain, 26.0, 29.5, "°", "prototype 27.6°", min(plain) > max(kalman)),
        Check("Fig 12", "", "rms error on ψ_mod, 3 Hz, 12°", corrected, 5.5, 7.5, "°", "prototype 6.3°",
              min(corrected) > max(kalman)),
        Check("Fig 12", "", "rms error on ψ_mod over that of the Kalman filter", ratios, 8.0, 25.0, "",
              "prototype 6.3° / 0.51° = 12; more where the filter does better", min(ratios) > 2.0),
        Check("Fig 12", "a digital filter lags", "phase lag on ψ_mod, 3 Hz", lags, 44.0, 58.0, "°",
              "second-order Butterworth 53°, less the lead of ψ_mod, ≈ 6°", min(lags) > 20.0),
    )  # fmt: skip
    part = swung.runs[0].during(FAST[0], FAST[0] + 2.0)
    with picture(
        laboratory.out / "fig12.png", "Fig 12: pitch through a second-order low-pass of 5 Hz, fast motion", (3.6,)
    ) as (axes,):
        draw_estimates(
            axes,
            part,
            ("pitch_low_pass", r"low-pass on $\psi_{acc}$", ORANGE, "--"),
            ("pitch_lever_arm_low_pass", r"low-pass on $\psi_{mod}$", BLUE, "-"),
            ("pitch", "Kalman filter", RED, "-"),
        )
        axes.set_xlim(part.times[0], part.times[-1])
    return Result("fig12", "Second-order low-pass of 5 Hz", checks, (swung.experiment.command(),))
