"""Runs any system of FMUs that a System Structure and Parameterization (SSP) file describes; knows no robot."""

from .load import check, load
from .pool import InstancePool
from .record import Channel, Signal, Sink
from .results import CsvSink, Result, Table
from .simulate import simulate
from .system import System

__all__ = [
    "Channel",
    "CsvSink",
    "InstancePool",
    "Result",
    "Signal",
    "Sink",
    "System",
    "Table",
    "check",
    "load",
    "simulate",
]
