"""A motor on a bench in closed form, with its own noise: nothing of it is shared with what is tested."""

from dataclasses import dataclass
from math import exp, log, pi

import numpy as np

from twip.lab.identification.recording import Recording

KT = 0.0134
QUANTUM = 2.0 * pi / 2048


@dataclass(frozen=True)
class Motor:
    """T_c and sigma forward and reverse (N.m, N.m.s/rad), inertia (kg.m2)."""

    coulomb_forward: float = 7.223e-4
    viscous_forward: float = 1.886e-6
    coulomb_reverse: float = 5.333e-4
    viscous_reverse: float = 2.394e-6
    bench_inertia: float = 1.5450e-6

    def run(self, steps, interval=1e-3):
        """Return time, current and exact shaft angle and speed for steps of (duration s, current A), from rest."""
        time, current, angles, speeds = [np.zeros(1)], [np.zeros(1)], [np.zeros(1)], [np.zeros(1)]
        speed = angle = begin = 0.0
        for duration, amperes in steps:
            t = np.arange(1, round(duration / interval) + 1) * interval
            sign = 1.0 if (speed or amperes) > 0.0 else -1.0
            coulomb, viscous = (
                (self.coulomb_forward, self.viscous_forward)
                if sign > 0
                else (self.coulomb_reverse, self.viscous_reverse)
            )
            b = viscous / self.bench_inertia
            final = (sign * KT * amperes - coulomb) / viscous
            start = sign * speed
            if start == 0.0 and final <= 0.0:
                theta, omega = np.zeros(len(t)), np.zeros(len(t))
            else:
                stop = log(1.0 - start / final) / b if final < 0.0 else np.inf
                moving = np.minimum(t, stop)
                decay = np.exp(-b * moving)
                theta = final * moving + (start - final) * (1.0 - decay) / b
                omega = np.where(t < stop, final + (start - final) * decay, 0.0)
            time.append(begin + t)
            current.append(np.full(len(t), amperes))
            angles.append(angle + sign * theta)
            speeds.append(sign * omega)
            begin, angle, speed = begin + duration, angles[-1][-1], speeds[-1][-1]
        return tuple(np.concatenate(parts) for parts in (time, current, angles, speeds))

    def record(self, steps, seed, noise=1e-3, resolution=1e-4, offset=5e-4, zero=4.0):
        """Return what a bench with a noisy, quantized current sensor and an encoder records."""
        random = np.random.default_rng(seed)
        time, current, angle, _ = self.run(steps)
        read = current + offset * random.standard_normal() + noise * random.standard_normal(len(time))
        counts = np.floor(angle / QUANTUM + random.random())
        recording = Recording("bench", time, resolution * np.round(read / resolution), counts * QUANTUM, None, QUANTUM)
        return recording.zeroed(zero) if zero else recording


def friction(speed, coulomb, static, stribeck_speed, viscous):
    """Return the magnitude of Stribeck friction at speed magnitudes."""
    return coulomb + (static - coulomb) * np.exp(-((speed / stribeck_speed) ** 2)) + viscous * speed


def weight(speed, stribeck_speed):
    """Return what is left of the Stribeck effect at a speed."""
    return exp(-((speed / stribeck_speed) ** 2))
