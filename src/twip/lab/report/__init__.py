"""Reports of runs and of sweeps: one HTML file that opens anywhere, offline."""

from .page import report
from .sweep import sweep_report

__all__ = ["report", "sweep_report"]
