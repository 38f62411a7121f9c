"""Recorded signals from other people's MCAP files."""

from .robot_log import RobotLog, Series, open_log

__all__ = ["RobotLog", "Series", "open_log"]
