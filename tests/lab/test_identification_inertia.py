"""The inertia: the paper's estimate and curve fit, and the fit to encoder counts."""

import numpy as np
import pytest
from identification_motor import KT, Motor

from twip.lab.identification import identify
from twip.lab.identification.experiments import run_up, staircase
from twip.lab.identification.inertia import RunUpResiduals, Shaft, estimated_inertia, fit_curve
from twip.robot.parameters import value

MOTOR = Motor()
PARTS = ("wheel_mass", "wheel_radius", "gear_ratio", "rotor_inertia", "gear_inertia")


def test_the_estimate_of_equation_12():
    estimate = estimated_inertia(*(value(name) for name in PARTS))
    assert estimate == pytest.approx(1.3028e-6, rel=1e-4)
    assert 1.5450e-6 / estimate - 1.0 == pytest.approx(0.186, abs=0.001)  # "approximately equal", says the paper


def test_a_wheel_with_more_mass_at_the_rim_explains_the_difference():
    mass, radius, ratio, *shaft = (value(name) for name in PARTS)
    assert 0.68 * mass * radius**2 / ratio**2 + sum(shaft) == pytest.approx(1.5450e-6, rel=2e-3)


def test_the_estimate_lies_outside_the_interval_of_a_measured_run_up():
    found = identify([MOTOR.record(e.steps, [1, k]) for k, e in enumerate((staircase(), run_up()))], KT)
    assert found.inertia.covers(MOTOR.bench_inertia)
    assert not found.inertia.covers(estimated_inertia(*(value(name) for name in PARTS)))


def test_the_papers_curve_fit():
    """omega = a (1 - e^-bt) at 70 mA, J = sigma/b: eqs (8), (10), (11), with the speed counted over 10 ms."""
    recording = MOTOR.record(run_up(0.07).steps, 1)
    begin = 4.0
    counted = recording.angle[::10]
    time = recording.time[::10]
    speed, middle = np.diff(counted) / np.diff(time), time[1:] - 0.005
    chosen = (middle > begin) & (middle < begin + 6.0)
    found = fit_curve(middle[chosen] - begin, speed[chosen])
    assert found.a == pytest.approx((KT * 0.07 - MOTOR.coulomb_forward) / MOTOR.viscous_forward, rel=2e-3)
    assert found.inertia(MOTOR.viscous_forward) == pytest.approx(MOTOR.bench_inertia, rel=2e-3)


@pytest.mark.parametrize("angular", [True, False])
def test_sensitivities_are_the_derivatives(angular):
    time, chosen = np.linspace(0.0, 3.0, 7), np.full(7, angular)
    at = np.array([20.0, 114.0, 1.22])

    def motion(p):
        return Shaft(time, np.full(7, p[0]), np.full(7, p[1]), np.full(7, p[2])).motion(chosen)

    for found, step in zip(
        Shaft(time, *(np.full(7, x) for x in at)).sensitivities(chosen), np.eye(3) * 1e-5, strict=True
    ):
        assert found == pytest.approx((motion(at + step) - motion(at - step)) / 2e-5, rel=1e-6, abs=1e-6)


def test_the_normal_equations_are_those_of_the_residuals():
    found = identify([MOTOR.record(e.steps, [2, k]) for k, e in enumerate((staircase(), run_up()))], KT)
    residuals = RunUpResiduals(found.runs, found.frictions, KT)
    x = residuals.start(1.4e-6)
    x[1 : residuals.first_speed] = np.random.default_rng(1).standard_normal(residuals.first_speed - 1)

    def cost(x):
        deviations = residuals.deviations(x) / residuals.errors[residuals.points]
        return 0.5 * (np.sum(deviations**2) + np.sum(x[1 : residuals.first_speed] ** 2))

    _, slope = residuals.normal_equations(x)
    steps = np.eye(len(x)) * 1e-5
    numeric = np.array([(cost(x + step) - cost(x - step)) / 2e-5 for step in steps])
    assert slope == pytest.approx(-numeric, rel=1e-4, abs=1e-6 * np.max(np.abs(numeric)))


def test_steady_samples_and_run_ups_share_no_data():
    recording = MOTOR.record(staircase().steps, 1)
    found = identify([recording], KT)
    for run in found.runs:
        assert run.time[-1] < 6.0 - 1.0  # a level is kept for 6 s, its last windows are the steady ones
