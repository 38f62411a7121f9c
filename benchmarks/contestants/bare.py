"""The bare calls of a step, from compiled code."""

import numpy as np
from numba import njit

from twip.cosim.compiled_loop import address, call_access, call_step
from twip.cosim.execution import Execution
from twip.cosim.native import NO_FUNCTIONS, native_functions

HANDLE, SETTER, INPUTS, INPUT_COUNT, FIRST_INPUT, STEPPER, GETTER, OUTPUTS, OUTPUT_COUNT, FIRST_OUTPUT = range(10)


class BareCalls:
    """Tables of the calls, one row per component in the order of execution; all variables must be Real."""

    def __init__(self, execution: Execution, native: bool):
        references: list[int] = []
        rows = []
        for i in execution.schedule.order:
            port = execution.ports[i]
            found = (native_functions(port.instance) if native else None) or NO_FUNCTIONS
            row = [found.component or port.instance.handle]
            for groups, function in ((port.inputs, found.set_real), (port.outputs, found.get_real)):
                group = groups[0] if groups else None
                names = group.value_references if group else []
                call = function or (address(group.call) if group else 0)
                row += [call, len(references), len(names), group.first if group else 0]
                references += names
                if len(row) == 5:
                    row.append(found.do_step or port.instance.stepper)
            rows.append(row)
        self.rows = np.array(rows, np.int64)
        self._execution = execution
        self.tables = (self.rows, np.array(references, np.uint32), execution.row)


@njit(cache=True)
def bare_steps(times, step_size, recorded, rows, references, values):
    """Set, step and get, nothing else: every component steps with the inputs that were `recorded` for the step."""
    wanted, scratch = np.int64(references.ctypes.data), np.int64(values.ctypes.data)
    for k in range(len(times) - 1):
        first = np.int64(recorded[k].ctypes.data)
        for i in range(len(rows)):
            row = rows[i]
            if row[INPUT_COUNT]:
                inputs = first + 8 * row[FIRST_INPUT]
                call_access(row[SETTER], row[HANDLE], wanted + 4 * row[INPUTS], row[INPUT_COUNT], inputs)
            call_step(row[STEPPER], row[HANDLE], times[k], step_size)
            outputs = scratch + 8 * row[FIRST_OUTPUT]
            call_access(row[GETTER], row[HANDLE], wanted + 4 * row[OUTPUTS], row[OUTPUT_COUNT], outputs)


@njit(cache=True)
def bare_calls(what, times, step_size, recorded, row, references, values):
    """Do one kind of call of one component, once per step: 0 set, 1 step, 2 get."""
    wanted, scratch = np.int64(references.ctypes.data), np.int64(values.ctypes.data)
    for k in range(len(times) - 1):
        if what == 0:
            inputs = np.int64(recorded[k].ctypes.data) + 8 * row[FIRST_INPUT]
            call_access(row[SETTER], row[HANDLE], wanted + 4 * row[INPUTS], row[INPUT_COUNT], inputs)
        elif what == 1:
            call_step(row[STEPPER], row[HANDLE], times[k], step_size)
        else:
            outputs = scratch + 8 * row[FIRST_OUTPUT]
            call_access(row[GETTER], row[HANDLE], wanted + 4 * row[OUTPUTS], row[OUTPUT_COUNT], outputs)
