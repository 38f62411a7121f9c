"""Runs any system of FMUs that a System Structure and Parameterization (SSP) file describes; knows no robot."""

from typing import TYPE_CHECKING

from ..errors import AbsentFileError, Place, Problem, TwipError, UnknownNameError
from ..lazy import later
from .coupling.algorithms import COUPLINGS
from .coupling.algorithms import DEFAULT as DEFAULT_COUPLING
from .coupling.algorithms import OPTIONS as COUPLING_OPTIONS
from .coupling.algorithms import named as couplings_that
from .coupling.coupling import INITIAL as INITIAL_COUPLING
from .coupling.coupling import Coupling
from .coupling.scheduling import make_schedule
from .fmus.component import ComponentError
from .fmus.description import file_fingerprint
from .fmus.isolation import START_LIMIT, TIME_LIMIT
from .fmus.pool import InstancePool
from .load import check, load
from .log.playback import ForeignLogError, Playback
from .log.playback import read as read_log
from .model.algorithm import Algorithm
from .model.schedule import Schedule
from .model.signals import Channel, Signal, Sink, columns
from .model.system import Copy, System
from .model.time_grid import TimeGrid, time_grid, time_problems
from .reading.arguments import names as as_names
from .reading.arguments import paths as as_paths
from .reading.wording import counted, did_you_mean, nearest
from .run.checkpoint import Checkpoint
from .run.options import Checkpoints, Inputs, Observer, Runtime
from .run.preparation import Request, grid_of, prepare
from .run.results import Result
from .scenario.live_inputs import LiveInputs, open_inputs
from .scenario.scenario_file import files_of as scenario_files
from .simulate import simulate
from .sinks import open_sink
from .sinks.base import FileSink, RunDetails
from .sinks.csv_sink import CsvSink
from .sinks.mcap_log import Attachment, McapLog, declare
from .sinks.table_sink import Table
from .ssp.parameter_file import Entry as ParameterEntry
from .ssp.parameter_file import parameters_of, write_parameter_set
from .values.units import BASE_UNITS, Unit
from .values.written import Value

if TYPE_CHECKING:
    from .inspection import Overview, inspect_file, inspect_run
    from .overview import Section
else:  # fmpy's validation takes its time to load, and a run does without
    __getattr__ = later(__name__, {"inspection": ("Overview", "inspect_file", "inspect_run"), "overview": ("Section",)})

__all__ = [
    "BASE_UNITS",
    "COUPLINGS",
    "COUPLING_OPTIONS",
    "DEFAULT_COUPLING",
    "INITIAL_COUPLING",
    "START_LIMIT",
    "TIME_LIMIT",
    "AbsentFileError",
    "Algorithm",
    "Attachment",
    "Channel",
    "Checkpoint",
    "Checkpoints",
    "ComponentError",
    "Copy",
    "Coupling",
    "CsvSink",
    "FileSink",
    "ForeignLogError",
    "Inputs",
    "InstancePool",
    "LiveInputs",
    "McapLog",
    "Observer",
    "Overview",
    "ParameterEntry",
    "Place",
    "Playback",
    "Problem",
    "Request",
    "Result",
    "RunDetails",
    "Runtime",
    "Schedule",
    "Section",
    "Signal",
    "Sink",
    "System",
    "Table",
    "TimeGrid",
    "TwipError",
    "Unit",
    "UnknownNameError",
    "Value",
    "as_names",
    "as_paths",
    "check",
    "columns",
    "counted",
    "couplings_that",
    "declare",
    "did_you_mean",
    "file_fingerprint",
    "grid_of",
    "inspect_file",
    "inspect_run",
    "load",
    "make_schedule",
    "nearest",
    "open_inputs",
    "open_sink",
    "parameters_of",
    "prepare",
    "read_log",
    "scenario_files",
    "simulate",
    "time_grid",
    "time_problems",
    "write_parameter_set",
]
