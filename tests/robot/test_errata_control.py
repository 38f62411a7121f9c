"""Section 5 of the paper as printed, and what becomes of it: eqs (49) to (63), see docs/errata.md."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
import test_closed_loop
from plain import instance, load, nominal_friction, started

from twip.robot.parameters import value
from twip.robot.plant import constants
from twip.robot.sliding_mode import balance_torque, speed_coefficient, voltages, yaw_torque

PLANT, CONTROLLER = load("plant").BLOCK, load("controller").BLOCK
N = value("gear_ratio")
MOTION = {"pitch": 0.2, "pitch_rate": -0.5, "wheel_rate": 12.0, "yaw_rate": 0.6}


def moved(torque, yaw=0.0, friction=True):
    """Return the plant in `MOTION` under the wheel torque u2 and the yaw torque u6 [N.m], back-EMF and viscosity in it.

    u2 and u6 are the motors' torques at stall: M21 (theta' - psi') and M65 phi' are lost on the way.
    """
    model = instance(CONTROLLER)
    a, loss = model.track_width / (2 * model.wheel_radius), speed_coefficient(model)
    common = torque - loss * (MOTION["wheel_rate"] - MOTION["pitch_rate"])
    turn = (yaw - a * a * loss * MOTION["yaw_rate"]) / a
    start = {f"{name}_start": number for name, number in MOTION.items()}
    return started(
        PLANT, **start, **(nominal_friction() if friction else {}), rolling_resistance=0.0,
        left_drive_torque=0.5 * (common - turn) / N, right_drive_torque=0.5 * (common + turn) / N,
    )  # fmt: skip


def test_eq_49_compensates_55_percent():
    """Friction in f2 alone reaches u2 times M24/(M22 + M24); with -F_c in f4 too, as eq (34) has it, it is whole."""
    model = instance(CONTROLLER)
    law = balance_torque(model, **MOTION, reach=1.0)
    friction = -N * (value("left.coulomb_forward") + value("right.coulomb_forward"))
    m22, m44, reflected, first_moment, *_ = constants(instance(PLANT))
    m24 = first_moment * math.cos(MOTION["pitch"]) - reflected
    wanted = -30.0 - 10.0 * MOTION["pitch_rate"]  # psi'' of s1' = -epsilon1
    missed = {
        "none": moved(law).pitch_acceleration - wanted,
        "printed": moved(law - (m24 * friction) / (m22 + m24)).pitch_acceleration - wanted,
        "both": moved(law - (m24 * friction + m22 * friction) / (m22 + m24)).pitch_acceleration - wanted,
    }
    assert missed["both"] == pytest.approx(0.0, abs=1e-9)
    assert missed["none"] == pytest.approx(-(m22 + m24) * friction / (m22 * m44 - m24 * m24), rel=1e-9)
    upright = first_moment - reflected
    # upright, friction counts as 4.17 rad/s2: Delta1 of eq (54)
    assert -(m22 + upright) * friction / (m22 * m44 - upright * upright) == pytest.approx(4.17, abs=5e-3)
    assert upright / (m22 + upright) == pytest.approx(0.55, abs=5e-3)
    assert 1 - missed["printed"] / missed["none"] == pytest.approx(m24 / (m22 + m24), rel=1e-9)


@pytest.mark.parametrize(("c4", "printed_holds"), [(1.0, True), (0.5, False)])
def test_eq_51_lacks_a_division_by_c4(c4, printed_holds):
    """s2' = -epsilon2 takes (c3/c4) M66; the printed c3 M66 does it for c4 = 1 alone."""
    model = instance(CONTROLLER, c4=c4)
    ours = yaw_torque(model, **MOTION, reach=1.0)
    m66 = constants(instance(PLANT)).m66 + model.body_mass * (model.cog_height * math.sin(MOTION["pitch"])) ** 2
    printed = ours + (model.c3 / c4 - model.c3) * m66 * MOTION["yaw_rate"]

    def surface_rate(torque):
        return model.c3 * MOTION["yaw_rate"] + c4 * moved(0.0, torque, friction=False).yaw_acceleration

    assert surface_rate(ours) == pytest.approx(-model.epsilon2, rel=1e-9)
    assert (surface_rate(printed) == pytest.approx(-model.epsilon2, rel=1e-9)) == printed_holds


def printed_voltages(balance, yaw):
    """Eqs (52) and (53) as printed: left, right."""
    per_torque = value("resistance") / (N * value("torque_constant"))
    common, difference = -0.5 * per_torque * balance, per_torque * value("wheel_radius") / value("track_width") * yaw
    return common - difference, common + difference


@pytest.mark.parametrize(("balance", "yaw"), [(0.3, 0.0), (0.0, 0.05), (0.3, -0.05)])
def test_eqs_52_53_contradict_eq_40(balance, yaw):
    """Eq (40) makes torques of voltages. Put into it, (52) and (53) give -u2 and u6; ours give u2 and u6."""

    def eq_40(left, right):
        gain = N * value("torque_constant") / value("resistance")
        return gain * (right + left), gain * value("track_width") / (2 * value("wheel_radius")) * (right - left)

    assert eq_40(*printed_voltages(balance, yaw)) == pytest.approx((-balance, yaw), abs=1e-15)
    assert eq_40(*voltages(instance(CONTROLLER), balance, yaw)) == pytest.approx((balance, yaw), abs=1e-15)


def fall(monkeypatch, start, printed):
    """Return when |pitch| passes 59 deg after the release [s], or None, of the whole robot."""
    step = test_closed_loop.BLOCKS["controller"].step

    def turned_round(v, time, step_size):
        before = v.ticks
        step(v, time, step_size)
        if v.ticks > before:  # the common part of both changes its sign, the difference stays
            v.left_voltage, v.right_voltage = -v.right_voltage, -v.left_voltage

    monkeypatch.setitem(test_closed_loop.BLOCKS, "printed", SimpleNamespace(step=turned_round))
    robot = test_closed_loop.Robot({"plant": {"pitch_start": math.radians(start), "hold_time": 1.0}})
    if printed:
        robot.order[-1] = ("printed", robot.controller)
    signals = robot.run(2.0)
    beyond = np.flatnonzero(np.abs(signals["pitch"]) > math.radians(59))
    return float(signals["time"][beyond[0]]) - 1.0 if beyond.size else None


@pytest.mark.parametrize(("start", "duration"), [(27, 0.112), (10, 0.200), (5, 0.260)])
def test_eqs_52_53_as_printed_throw_the_robot_down(monkeypatch, start, duration):
    """Faster than without any drive (0.166 s from 27 deg); one sample of 5 ms is the tolerance."""
    assert fall(monkeypatch, start, printed=True) == pytest.approx(duration, abs=5e-3)


def test_eqs_52_53_corrected_stand(monkeypatch):
    assert fall(monkeypatch, 27, printed=False) is None


def test_eqs_56_to_62_the_derivative_of_the_lyapunov_function_has_the_other_sign():
    """V = s^2/2 of a surface that approaches 0 falls: V' = s s'; the printed -s s' would have it grow."""
    for uncertainty in (0.0, 10.0, -10.0):
        epsilon, c, s, h = 30.0, 1.0, 2.0, 1e-4
        for _ in range(100):
            rate = -epsilon * math.copysign(1.0, s) + c * uncertainty  # eqs (46) and (54)
            derivative = (0.5 * (s + h * rate) ** 2 - 0.5 * (s - h * rate) ** 2) / (2 * h)
            assert derivative < 0.0
            assert derivative == pytest.approx(s * rate, rel=1e-9)
            assert derivative == pytest.approx(s * (-epsilon * math.copysign(1.0, s) + c * uncertainty), rel=1e-9)
            printed = -s * (epsilon * math.copysign(1.0, s) + c * uncertainty)  # eq (57)
            assert (derivative == pytest.approx(printed, rel=1e-9)) == (uncertainty == 0.0)
            s += h * rate


@pytest.mark.parametrize("surface", [1.0, -1.0])
def test_eqs_58_63_need_the_magnitude(surface):
    """Delta = -50 fulfils epsilon = 30 > c Delta, yet V grows where s < 0: the condition is epsilon > c sup |Delta|."""
    epsilon, c, uncertainty = 30.0, 1.0, -50.0
    assert epsilon > c * uncertainty
    rate = surface * (-epsilon * surface + c * uncertainty)
    assert (rate > 0.0) == (surface < 0.0)


@pytest.mark.parametrize(("degrees", "expected"), [(0.0, 0.0), (1.0, 0.0976), (-2.0, -0.1952)])
def test_eq_58_says_nothing_of_the_wheels(degrees, expected):
    """Held at a pitch e, the robot has R M g L sin e/(M22 + M24) m/s2: it drifts at e = 0, and runs away otherwise."""
    lean = math.radians(degrees)
    model = instance(CONTROLLER)
    torque = balance_torque(model, lean, 0.0, 8.0, 0.0, 0.0)
    v = started(
        PLANT, pitch_start=lean, wheel_rate_start=8.0, rolling_resistance=0.0,
        **{f"{side}_drive_torque": 0.5 * (torque - speed_coefficient(model) * 8.0) / N for side in ("left", "right")},
    )  # fmt: skip
    assert v.pitch_acceleration == pytest.approx(0.0, abs=1e-10)
    assert v.wheel_radius * v.wheel_acceleration == pytest.approx(expected, abs=2e-4)


def test_eq_45_approaches_upright_with_a_positive_ratio_alone():
    """On s1 = 0 the pitch follows psi' = -(c1/c2) psi: away from 0 if that is negative. The block refuses c1 <= 0."""
    assert CONTROLLER.check(instance(CONTROLLER)) == []
    assert CONTROLLER.check(instance(CONTROLLER, c1=-10.0))[0].startswith("c1 = -10 1/s must be positive")
