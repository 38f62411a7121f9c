"""Runs any system of FMUs that a System Structure and Parameterization (SSP) file describes; knows no robot."""

from ..errors import AbsentFileError, Place, Problem, TwipError, UnknownNameError
from .fmus.component import ComponentError
from .fmus.pool import InstancePool
from .load import check, load
from .log.playback import ForeignLogError
from .log.playback import read as read_log
from .model.signals import Channel, Signal, Sink
from .model.system import System
from .run.results import Result
from .scenario.live_inputs import LiveInputs
from .simulate import simulate
from .sinks import open_sink
from .sinks.base import FileSink, RunDetails
from .sinks.csv_sink import CsvSink
from .sinks.mcap_log import McapLog
from .sinks.table_sink import Table

__all__ = [
    "AbsentFileError",
    "Channel",
    "ComponentError",
    "CsvSink",
    "FileSink",
    "ForeignLogError",
    "InstancePool",
    "LiveInputs",
    "McapLog",
    "Place",
    "Problem",
    "Result",
    "RunDetails",
    "Signal",
    "Sink",
    "System",
    "Table",
    "TwipError",
    "UnknownNameError",
    "check",
    "load",
    "open_sink",
    "read_log",
    "simulate",
]
