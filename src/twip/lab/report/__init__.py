"""Reports of runs and of sweeps: one HTML file that opens anywhere, offline."""

from .frame import ENDINGS
from .page import report
from .sweep import sweep_report

__all__ = ["ENDINGS", "report", "sweep_report"]
