"""Runs any system of FMUs that a System Structure and Parameterization (SSP) file describes; knows no robot."""

from .fmus.pool import InstancePool
from .load import check, load
from .log.mcap_log import McapLog
from .log.playback import read as read_log
from .model.signals import Channel, Signal, Sink
from .model.system import System
from .run.results import CsvSink, Result, Table
from .scenario.live_inputs import LiveInputs
from .simulate import simulate

__all__ = [
    "Channel",
    "CsvSink",
    "InstancePool",
    "LiveInputs",
    "McapLog",
    "Result",
    "Signal",
    "Sink",
    "System",
    "Table",
    "check",
    "load",
    "read_log",
    "simulate",
]
