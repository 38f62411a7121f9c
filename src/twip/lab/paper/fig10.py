"""Fig 10: the lever-arm correction of eqs (43) and (44), with the right signs and as printed."""

from ..drawing import ORANGE, RED, picture
from .checks import Check, Result
from .laboratory import Experiment, Laboratory, Run
from .swing import FAST, PRINTED_SIGNS, draw_estimates, error, swings


def run(laboratory: Laboratory) -> Result:
    """Swing the body with the wheels locked, twice: correction with the right signs, and with the printed ones."""
    swung = swings(laboratory)
    kept = swung.experiment
    printed = Experiment(kept.stop_time, {**kept.start_values, **PRINTED_SIGNS}, (), kept.inputs)
    wrong = [r.sampled() for r in laboratory.runs(printed)]
    without, right = swung.errors("pitch_arctan", FAST), swung.errors("pitch_lever_arm", FAST)
    as_printed = [error(r, "pitch_lever_arm", FAST) for r in wrong]
    gains = [a / b for a, b in zip(without, right, strict=True)]
    checks = (
        Check("Fig 10", "the modification by eqs (43) and (44) is significant and necessary",
              "rms error with the right signs, 3 Hz, 12°",
              right, 1.0, 1.6, "°", "prototype 1.31°", max(right) < min(without) / 5.0, "with the right signs"),
        Check("Fig 10", "", "rms error without over rms error with the right signs", gains, 15.0, 30.0, "",
              "prototype 25.9° / 1.31° = 20", min(gains) > 5.0, "with the right signs"),
        Check("Fig 10", "eqs (43) and (44) as printed", "rms error with the printed signs, 3 Hz, 12°",
              as_printed, 36.0, 42.0, "°", "prototype 38.9°", max(as_printed) < min(without),
              "worse than no correction",
              "both sin θ terms have the wrong sign for a sensor above the axle"),
    )  # fmt: skip
    with picture(
        laboratory.out / "fig10.png", "Fig 10: pitch by the lever-arm corrected accelerometer", (2.6, 2.9)
    ) as (top, low):
        shown: tuple[tuple[Run, str], ...] = ((swung.runs[0], "right signs"), (wrong[0], "printed signs"))
        for axes, (recorded, words) in zip((top, low), shown, strict=True):
            part = recorded.during(FAST[0], FAST[0] + 2.0)
            draw_estimates(
                axes,
                part,
                ("pitch_arctan", r"uncorrected $\psi_{acc}$", ORANGE, "--"),
                ("pitch_lever_arm", rf"corrected $\psi_{{mod}}$, {words}", RED, "-"),
            )
            axes.set_title(words)
            axes.set_xlim(part.times[0], part.times[-1])
    return Result("fig10", "Lever-arm correction", checks, (kept.command(), printed.command()))
