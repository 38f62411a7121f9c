"""From recordings of one motor to its parameters: friction of both directions and the inertia on its shaft."""

from collections.abc import Sequence
from dataclasses import dataclass

from ...errors import TwipError
from .estimate import Estimate
from .friction import WAYS, Friction, balance
from .inertia import fit_inertia
from .recording import Recording, read_by_one_sensor
from .run_up import RunUp, run_ups
from .steady import SteadySamples, joined, steady_samples
from .stribeck import fit_friction

PASSES = 8
"""Most rounds between friction, which needs the inertia to correct what acceleration is left, and the inertia."""
AGREED = 1e-6
"""Relative change of the inertia that ends the rounds."""


@dataclass(frozen=True)
class Identification:
    """What the data of one motor say; `frictions` by direction (1 forward, -1 reverse), those that have samples."""

    torque_constant: float
    samples: SteadySamples
    runs: list[RunUp]
    frictions: dict[int, Friction]
    inertia: Estimate

    @property
    def estimates(self) -> list[Estimate]:
        """Every parameter, in the order of the table, also those that the data cannot tell."""
        found: list[Estimate] = []
        for direction, way in WAYS.items():
            if direction in self.frictions:
                found += self.frictions[direction].estimates
            else:
                count = len(self.samples.towards(direction))
                reason = f"{count} steady samples in this direction" if count else "no steady samples in this direction"
                units = {"coulomb": "N.m", "viscous": "N.m.s/rad", "static": "N.m", "stribeck_speed": "rad/s"}
                found += [Estimate(f"{kind}_{way}", unit, None, reason=reason) for kind, unit in units.items()]
        return [*found, self.inertia]

    def __getitem__(self, name: str) -> Estimate:
        return next(estimate for estimate in self.estimates if estimate.name == name)


def identify(
    recordings: Sequence[Recording], torque_constant: float, given: Sequence[SteadySamples] = ()
) -> Identification:
    """Identify one motor from recordings and from steady samples that are given as such.

    torque_constant K_t [N.m/A] is what turns current into torque: all torques and the inertia scale with it, and no
    interval knows its error. Raises TwipError if the data hold neither steady samples nor anything else of use.
    """
    recordings = read_by_one_sensor(recordings)
    samples, runs = (
        joined([steady_samples(recordings), *given]) if given else steady_samples(recordings),
        run_ups(recordings),
    )
    if not len(samples):
        names = ", ".join(recording.name for recording in recordings)
        raise TwipError(
            f"{names}: there is no steady sample, that is 1 s at constant current and speed with the shaft turning"
        )
    if not runs:
        samples = samples.uncorrected()
        if not len(samples):
            raise TwipError("the speed is not steady anywhere, and there is no run-up that would tell the inertia")
    inertia = 0.0
    for _ in range(PASSES):
        frictions = {
            direction: friction
            for direction in WAYS
            if (friction := fit_friction(balance(samples, direction, torque_constant, inertia), direction)) is not None
        }
        estimate = fit_inertia(runs, frictions, torque_constant)
        last, inertia = inertia, estimate.value or 0.0
        if abs(inertia - last) <= AGREED * inertia:
            break
    return Identification(torque_constant, samples, runs, frictions, estimate)
