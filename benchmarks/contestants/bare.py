"""The bare calls of a step, from compiled code."""

import numpy as np
from numba import njit

from twip.cosim.coupling.compiled_loop import address, call_access, call_step, read_real, write_real
from twip.cosim.coupling.execution import Execution
from twip.cosim.fmus.native import NOT_NATIVE, native_access

(NATIVE, HANDLE, SETTER, INPUTS, INPUT_COUNT, FIRST_INPUT, STEPPER, FIRST_ARGUMENT, GETTER, OUTPUTS, OUTPUT_COUNT,
 FIRST_OUTPUT) = range(12)  # fmt: skip


class BareCalls:
    """Tables of the calls, one row per component in the order of execution; all variables must be Real."""

    def __init__(self, execution: Execution, native: bool):
        references: list[int] = []
        rows = []
        for i in execution.schedule.order:
            port = execution.ports[i]
            found = native_access(port.instance) if native else NOT_NATIVE
            handle = port.instance.handle
            row = [found.values, handle]
            for groups in (port.inputs, port.outputs):
                group = groups[0] if groups else None
                names = group.value_references if group else []
                row += [address(group.call) if group else 0, len(references), len(names), group.first if group else 0]
                references += names
                if len(row) == 6:
                    row += [found.do_step or port.instance.stepper, found.values or handle]
            rows.append(row)
        self.rows = np.array(rows, np.int64)
        self._execution = execution
        self.tables = (self.rows, np.array(references, np.uint32), execution.row)


@njit(cache=True)
def bare_set(row, recorded, references):
    """Set all inputs of a component."""
    if row[NATIVE] != 0:
        for j in range(row[INPUT_COUNT]):
            write_real(row[NATIVE] + 8 * np.int64(references[row[INPUTS] + j]), recorded[row[FIRST_INPUT] + j])
    elif row[INPUT_COUNT]:
        inputs = np.int64(recorded.ctypes.data) + 8 * row[FIRST_INPUT]
        wanted = np.int64(references.ctypes.data) + 4 * row[INPUTS]
        call_access(row[SETTER], row[HANDLE], wanted, row[INPUT_COUNT], inputs)


@njit(cache=True)
def bare_get(row, references, values):
    """Get all outputs of a component."""
    if row[NATIVE] != 0:
        for j in range(row[OUTPUT_COUNT]):
            reference = np.int64(references[row[OUTPUTS] + j])
            values[row[FIRST_OUTPUT] + j] = read_real(row[NATIVE] + 8 * reference)
    else:
        outputs = np.int64(values.ctypes.data) + 8 * row[FIRST_OUTPUT]
        wanted = np.int64(references.ctypes.data) + 4 * row[OUTPUTS]
        call_access(row[GETTER], row[HANDLE], wanted, row[OUTPUT_COUNT], outputs)


@njit(cache=True)
def bare_steps(times, step_size, recorded, rows, references, values):
    """Set, step and get, nothing else: every component steps with the inputs that were `recorded` for the step."""
    for k in range(len(times) - 1):
        for i in range(len(rows)):
            bare_set(rows[i], recorded[k], references)
            call_step(rows[i, STEPPER], rows[i, FIRST_ARGUMENT], times[k], step_size)
            bare_get(rows[i], references, values)


@njit(cache=True)
def bare_calls(what, times, step_size, recorded, row, references, values):
    """Do one kind of call of one component, once per step: 0 set, 1 step, 2 get."""
    for k in range(len(times) - 1):
        if what == 0:
            bare_set(row, recorded[k], references)
        elif what == 1:
            call_step(row[STEPPER], row[FIRST_ARGUMENT], times[k], step_size)
        else:
            bare_get(row, references, values)
