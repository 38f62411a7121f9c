"""Identification of friction and inertia from bench data (paper, section 2)."""

from .estimate import Estimate
from .identify import Identification, identify
from .recording import Recording
from .steady import SteadySamples, given_samples, steady_samples

__all__ = ["Estimate", "Identification", "Recording", "SteadySamples", "given_samples", "identify", "steady_samples"]
