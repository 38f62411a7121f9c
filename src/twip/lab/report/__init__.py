"""The report of a run: one HTML file with the moving robot, plots and tables that opens anywhere, offline."""

from .page import report

__all__ = ["report"]
