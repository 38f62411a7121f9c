"""Runs any system of FMUs that a System Structure and Parameterization (SSP) file describes; knows no robot."""

from twip.cosim.load import check, load
from twip.cosim.record import Channel, Signal, Sink
from twip.cosim.results import CsvSink, Result, Table
from twip.cosim.simulate import simulate
from twip.cosim.system import System

__all__ = ["Channel", "CsvSink", "Result", "Signal", "Sink", "System", "Table", "check", "load", "simulate"]
