"""The compiled loop: executes a schedule by numba, calling the FMI functions by their addresses.

It does what the plain loop does, in the same order and with the same arithmetic, so that both agree bit for bit. The
interpreter's lock is held throughout: FMUs written in Python need it. All compiled code is in this one file, because
numba's cache notices changes only in the file that holds a function.
"""

import ctypes
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic
from numpy.typing import NDArray

from ...errors import TwipError
from ..fmus.component import UNFIT
from ..fmus.native import DECLINED, native_access
from ..fmus.ports import InputGroup, OutputGroup, Ports
from ..model.schedule import Schedule
from ..values.types import EXACT, RECORDED_TYPES, TYPES
from .execution import Execution

IntTable = NDArray[np.int64]

FLOAT64, FLOAT32, INT8, UINT8, INT16, UINT16, INT32, UINT32, INT64, UINT64 = range(3, 13)
KINDS = {
    False: {"Real": 0, "String": 0, "Integer": 1, "Boolean": 2},
    True: {name: number for number, name in enumerate(RECORDED_TYPES, FLOAT64)} | {"String": FLOAT64},
}
"""By whether the function is told the number of values (FMI 3): from 3 on, in the order of the types. A String is a
float64, see `fmus.access`.
"""
_TYPE_OF = {kind: TYPES[name] for kinds in KINDS.values() for name, kind in kinds.items() if name != "String"}
LEAST, MOST = (
    np.array([np.clip(bound, -EXACT, EXACT) for bound in bounds], np.float64)
    for bounds in zip(*((t.minimum, t.maximum) for _, t in sorted(_TYPE_OF.items())), strict=True)
)
"""Bounds of whole numbers by kind."""
KIND, FIRST, SIZE, REFERENCES, VARIABLES, NATIVE, FMI_HANDLE, FMI_FUNCTION = range(8)
"""Columns of a table of groups: variables of one type of a component, the address of the component's values in memory
(0 if it does not give it), and the FMI function that sets or gets them with its first argument. In FMI 3, the sizes of
the variables follow their references.
"""
FINISHED, STOPPED, SET, STEP, GET, NOT_FINITE, UNMAPPED, OVERFLOWN = range(8)
"""How a run of steps ended."""


@intrinsic
def read_real(typing, address):  # type: ignore[no-untyped-def] # noqa: ARG001
    """Return the float64 at an address."""

    def generate(context, builder, _signature, values):  # type: ignore[no-untyped-def]
        return builder.load(builder.inttoptr(values[0], context.get_value_type(types.float64).as_pointer()))

    return types.float64(types.int64), generate


@intrinsic
def write_real(typing, address, value):  # type: ignore[no-untyped-def] # noqa: ARG001
    """Store a float64 at an address."""

    def generate(context, builder, _signature, values):  # type: ignore[no-untyped-def]
        pointer = builder.inttoptr(values[0], context.get_value_type(types.float64).as_pointer())
        builder.store(values[1], pointer)
        return context.get_dummy_value()

    return types.void(types.int64, types.float64), generate


@intrinsic
def call_access(typing, function, component, references, count, buffer):  # type: ignore[no-untyped-def] # noqa: ARG001
    """Call an FMI getter or setter at its address; all arguments are addresses or counts (int64)."""

    def generate(context, builder, _signature, values):  # type: ignore[no-untyped-def]
        word = context.get_value_type(types.int64)
        prototype = ir.FunctionType(context.get_value_type(types.int32), [word] * 4)
        return builder.call(builder.inttoptr(values[0], prototype.as_pointer()), values[1:])

    return types.int32(*[types.int64] * 5), generate


@intrinsic
def call_sized_access(typing, function, component, references, count, buffer, size):  # type: ignore[no-untyped-def] # noqa: ARG001
    """Call a getter or setter of FMI 3, which also takes the number of values; see `call_access`."""

    def generate(context, builder, _signature, values):  # type: ignore[no-untyped-def]
        word = context.get_value_type(types.int64)
        prototype = ir.FunctionType(context.get_value_type(types.int32), [word] * 5)
        return builder.call(builder.inttoptr(values[0], prototype.as_pointer()), values[1:])

    return types.int32(*[types.int64] * 6), generate


@intrinsic
def call_step_fmi3(typing, block, component, time, step_size):  # type: ignore[no-untyped-def] # noqa: ARG001
    """Do a step of FMI 3 with the block of memory at an address (see `instance_fmi3`); return status and flags."""

    def generate(context, builder, _signature, values):  # type: ignore[no-untyped-def]
        word, real, flag = (context.get_value_type(t) for t in (types.int64, types.float64, types.int32))
        byte = ir.IntType(8)
        prototype = ir.FunctionType(flag, [word, real, real, byte, word, word, word, word])
        addresses = [builder.add(values[0], ir.Constant(word, 8 * i)) for i in range(5)]
        pointers = [builder.inttoptr(address, word.as_pointer()) for address in addresses]
        for pointer in pointers[1:4]:
            builder.store(ir.Constant(word, 0), pointer)
        function = builder.inttoptr(builder.load(pointers[0]), prototype.as_pointer())
        status = builder.call(function, [*values[1:], ir.Constant(byte, 1), *addresses[1:]])
        ended = builder.or_(builder.load(pointers[2]), builder.load(pointers[3]))
        unfit = builder.icmp_unsigned("!=", ended, ir.Constant(word, 0))
        succeeded = builder.icmp_signed("<=", status, ir.Constant(flag, 1))
        return builder.select(builder.and_(unfit, succeeded), ir.Constant(flag, UNFIT), status)

    return types.int32(types.int64, types.int64, types.float64, types.float64), generate


@intrinsic
def call_step_fmi2(typing, function, component, time, step_size):  # type: ignore[no-untyped-def] # noqa: ARG001
    """Call fmi2DoStep at its address, with noSetFMUStatePriorToCurrentPoint true."""

    def generate(context, builder, _signature, values):  # type: ignore[no-untyped-def]
        word, real, flag = (context.get_value_type(t) for t in (types.int64, types.float64, types.int32))
        prototype = ir.FunctionType(flag, [word, real, real, flag])
        return builder.call(builder.inttoptr(values[0], prototype.as_pointer()), [*values[1:], ir.Constant(flag, 1)])

    return types.int32(types.int64, types.int64, types.float64, types.float64), generate


@njit(cache=True)
def call_step(stepper, handle, time, step_size):  # type: ignore[no-untyped-def]
    """Do a step of an instance by its `stepper`; return the status."""
    if stepper > 0:
        return call_step_fmi2(stepper, handle, time, step_size)
    return call_step_fmi3(-stepper, handle, time, step_size)


@njit(cache=True)
def is_whole(kind, value):  # type: ignore[no-untyped-def]
    """Tell whether a value is a whole number within the bounds of its kind."""
    return LEAST[kind] <= value <= MOST[kind] and value == np.floor(value)


@njit(cache=True)
def store(kind, scratch, position, value):  # type: ignore[no-untyped-def]
    """Write a value of FMI 3 at a position of the scratch memory (int32, 8 bytes per value); False if it is unfit."""
    if kind == FLOAT64:
        scratch.view(np.float64)[position] = value
        return True
    if kind == FLOAT32:
        scratch.view(np.float32)[position] = value
        return np.isfinite(np.float32(value))
    if not is_whole(kind, value):
        return False
    if kind == INT8:
        scratch.view(np.int8)[position] = np.int8(value)
    elif kind == INT16:
        scratch.view(np.int16)[position] = np.int16(value)
    elif kind == UINT16:
        scratch.view(np.uint16)[position] = np.uint16(value)
    elif kind == INT32:
        scratch[position] = np.int32(value)
    elif kind == UINT32:
        scratch.view(np.uint32)[position] = np.uint32(value)
    elif kind in (INT64, UINT64):
        scratch.view(np.int64)[position] = np.int64(value)
    else:
        scratch.view(np.uint8)[position] = np.uint8(value)
    return True


@njit(cache=True)
def load(kind, scratch, position):  # type: ignore[no-untyped-def]
    """Return a value of FMI 3 from the scratch memory; NaN where float64 does not hold it exactly."""
    if kind == FLOAT32:
        return np.float64(scratch.view(np.float32)[position])
    if kind == INT8:
        return np.float64(scratch.view(np.int8)[position])
    if kind == UINT8:
        return np.float64(scratch.view(np.uint8)[position])
    if kind == INT16:
        return np.float64(scratch.view(np.int16)[position])
    if kind == UINT16:
        return np.float64(scratch.view(np.uint16)[position])
    if kind == INT32:
        return np.float64(scratch[position])
    if kind == UINT32:
        return np.float64(scratch.view(np.uint32)[position])
    if kind in (INT64, UINT64):
        value = scratch.view(np.int64)[position]  # an unsigned one from 2**63 on is negative here
        return np.float64(value) if (-EXACT if kind == INT64 else 0) <= value <= EXACT else np.nan
    return 1.0 if scratch.view(np.uint8)[position] != 0 else 0.0


@njit(cache=True)
def write_reals(group, values, last, references):  # type: ignore[no-untyped-def]
    """Write the inputs of a native group that changed; stop and return False at one that is not finite."""
    for i in range(group[SIZE]):
        column = group[FIRST] + i
        value = values[column]
        if value != last[column]:
            if not np.isfinite(value):
                return False
            last[column] = value
            write_real(group[NATIVE] + 8 * np.int64(references[group[REFERENCES] + i]), value)
    return True


@njit(cache=True)
def read_reals(group, values, references):  # type: ignore[no-untyped-def]
    """Read the outputs of a native group; return the FMI status, or `UNFIT` when one is not finite."""
    status = np.int32(0)
    for i in range(group[SIZE]):
        value = read_real(group[NATIVE] + 8 * np.int64(references[group[REFERENCES] + i]))
        values[group[FIRST] + i] = value
        if not np.isfinite(value):
            status = np.int32(UNFIT)
    return status


@njit(cache=True)
def set_variables(group, values, last, references, changed, scratch):  # type: ignore[no-untyped-def]
    """Do what `set_changed` does for FMI 3, where a variable may have several columns."""
    kind, column = group[KIND], group[FIRST]
    first_size = group[REFERENCES] + group[VARIABLES]
    count = total = 0
    for j in range(group[VARIABLES]):
        end = column + np.int64(references[first_size + j])
        differs = False
        for i in range(column, end):
            if kind == FLOAT32:
                values[i] = np.float64(np.float32(values[i]))
            if values[i] != last[i]:
                differs = True
        if differs:
            changed[count] = references[group[REFERENCES] + j]
            count += 1
            for i in range(column, end):
                if not store(kind, scratch, total, values[i]):
                    return np.int32(UNFIT)
                last[i] = values[i]
                total += 1
        column = end
    if count == 0:
        return np.int32(0)
    buffers = np.int64(changed.ctypes.data), np.int64(scratch.ctypes.data)
    return call_sized_access(
        group[FMI_FUNCTION], group[FMI_HANDLE], buffers[0], np.int64(count), buffers[1], np.int64(total)
    )


@njit(cache=True)
def get_variables(group, values, references, scratch):  # type: ignore[no-untyped-def]
    """Do what `get_all` does for FMI 3."""
    kind, first, size = group[KIND], group[FIRST], group[SIZE]
    wanted = np.int64(references.ctypes.data) + 4 * group[REFERENCES]
    buffer = np.int64(values.ctypes.data) + 8 * first if kind == FLOAT64 else np.int64(scratch.ctypes.data)
    status = call_sized_access(group[FMI_FUNCTION], group[FMI_HANDLE], wanted, group[VARIABLES], buffer, size)
    if status < 0 or status > 1:
        return status
    for i in range(size):
        value = values[first + i] if kind == FLOAT64 else load(kind, scratch, i)
        if not np.isfinite(value):
            return np.int32(UNFIT)
        values[first + i] = value
    return status


@njit(cache=True)
def set_changed(group, values, last, references, changed, reals, integers):  # type: ignore[no-untyped-def]
    """Set the inputs of a group that differ from what was set last; return the FMI status, or `UNFIT`."""
    if group[NATIVE] != 0 and write_reals(group, values, last, references):
        return np.int32(0)
    if group[KIND] > 2:
        return set_variables(group, values, last, references, changed, integers)
    count = 0
    for i in range(group[SIZE]):
        column = group[FIRST] + i
        value = values[column]
        if value != last[column]:
            last[column] = value
            changed[count] = references[group[REFERENCES] + i]
            if group[KIND] == 0:
                reals[count] = value
            elif is_whole(group[KIND], value):
                integers[count] = np.int32(value)
            else:
                return np.int32(UNFIT)
            count += 1
    if count == 0:
        return np.int32(0)
    buffer = np.int64(reals.ctypes.data if group[KIND] == 0 else integers.ctypes.data)
    return call_access(group[FMI_FUNCTION], group[FMI_HANDLE], np.int64(changed.ctypes.data), np.int64(count), buffer)


@njit(cache=True)
def get_all(group, values, references, integers):  # type: ignore[no-untyped-def]
    """Get the outputs of a group, reals straight into the vector; return the FMI status, or `UNFIT`."""
    if group[NATIVE] != 0:
        return read_reals(group, values, references)
    if group[KIND] > 2:
        return get_variables(group, values, references, integers)
    first = group[FIRST]
    wanted = np.int64(references.ctypes.data) + 4 * group[REFERENCES]
    if group[KIND] == 0:
        buffer = np.int64(values.ctypes.data) + 8 * first
        return call_access(group[FMI_FUNCTION], group[FMI_HANDLE], wanted, group[SIZE], buffer)
    status = call_access(group[FMI_FUNCTION], group[FMI_HANDLE], wanted, group[SIZE], np.int64(integers.ctypes.data))
    for i in range(group[SIZE]):
        values[first + i] = integers[i]
    return status


@njit(cache=True)
def translate(value, entries, begin, end):  # type: ignore[no-untyped-def]
    """Look a value up in a part of the entries (source, target), which increase; return whether it is there, and what
    it becomes, itself if it is not.
    """
    low, high = begin, end
    while low < high:
        middle = (low + high) // 2
        if entries[middle, 0] < value:
            low = middle + 1
        else:
            high = middle
    if low < end and entries[low, 0] == value:
        return True, entries[low, 1]
    return False, value


class Plan(NamedTuple):
    """What is done in each step; of the `Schedule` where nothing else is said."""

    driven: NDArray[np.int32]
    """Columns that the caller's inputs write, see `Execution`."""
    driven_every: IntTable
    order: NDArray[np.int32]
    stage_order: NDArray[np.int32]
    stage_copies: NDArray[np.int32]
    destination: NDArray[np.int32]
    source: NDArray[np.int32]
    factor: NDArray[np.float64]
    offset: NDArray[np.float64]
    middle: NDArray[np.bool_]
    owner: NDArray[np.int32]
    every: IntTable
    copy_every: IntTable
    first_entry: IntTable
    """See `mapping_table`."""
    entries: NDArray[np.float64]
    partial: NDArray[np.bool_]


class State(NamedTuple):
    """What a step changes; of the `Execution` where nothing else is said."""

    values: NDArray[np.float64]
    last: NDArray[np.float64]
    """The values that were set last (columns,)."""
    samples: NDArray[np.float64]
    turn: IntTable
    reached: NDArray[np.float64]
    since: NDArray[np.float64]
    clock: NDArray[np.float64]
    failed: IntTable
    """Component, group and status of what went wrong (3,)."""


class Calls(NamedTuple):
    """How the components are called."""

    steppers: IntTable
    """By component: first argument and address of what steps it, then those of FMI, for what is declined."""
    setters: IntTable
    """Table of the groups of inputs, and by component the row of its first one; see `group_table`."""
    first_setter: IntTable
    getters: IntTable
    first_getter: IntTable
    references: NDArray[np.uint32]
    """Value references of all groups."""
    changed: NDArray[np.uint32]
    """Memory for value references and values on their way, as long as the widest group."""
    reals: NDArray[np.float64]
    integers: NDArray[np.int32]


@njit(cache=True)
def run_steps(times, step_size, inputs, rows, stop, plan, state, calls):  # type: ignore[no-untyped-def]
    """Do one step per row; return how many were finished and how it ended."""
    driven, driven_every, order, stage_order, stage_copies, destination, source, factor, offset = plan[:9]
    middle, owner, every, copy_every, first_entry, entries, partial = plan[9:]
    values, last, samples, turn, reached, since, clock, failed = state
    steppers, setters, first_setter, getters, first_getter, references, changed, reals, integers = calls
    for k in range(rows.shape[0]):
        if stop[0]:
            return k, STOPPED
        number = turn[0] + 1
        end = np.float64(number)
        reached[-1] = end - 1.0
        for j in range(driven.shape[0]):
            if driven_every[j] == 1 or number % driven_every[j] == 0:
                values[driven[j]] = inputs[k, j]
        for stage in range(stage_order.shape[0] - 1):
            for c in range(stage_copies[stage], stage_copies[stage + 1]):
                if copy_every[c] != 1 and number % copy_every[c] != 0:
                    continue
                value = factor[c] * values[source[c]] + offset[c]
                if first_entry[c] < first_entry[c + 1] or partial[c]:
                    known, value = translate(value, entries, first_entry[c], first_entry[c + 1])
                    if partial[c] and not known:
                        failed[0] = c
                        return k, UNMAPPED
                if middle[c]:
                    at = reached[owner[c]]
                    if at > samples[1, c]:
                        samples[2, c], samples[3, c] = samples[0, c], samples[1, c]
                    samples[0, c], samples[1, c] = value, at
                    wanted = end - 0.5 * copy_every[c]
                    value = value + (wanted - at) / (at - samples[3, c]) * (value - samples[2, c])
                values[destination[c]] = value
                if not np.isfinite(value):
                    failed[0] = c
                    return k, OVERFLOWN
            for position in range(stage_order[stage], stage_order[stage + 1]):
                i = order[position]
                if every[i] != 1 and number % every[i] != 0:
                    continue
                failed[0] = i
                clock[0] = times[k]
                for g in range(first_setter[i], first_setter[i + 1]):
                    status = set_changed(setters[g], values, last, references, changed, reals, integers)
                    if status < 0 or status > 1:
                        failed[1], failed[2] = g - first_setter[i], status
                        return k, SET
                begin, size = times[k] if every[i] == 1 else since[i], every[i] * step_size
                status = call_step(steppers[i, 1], steppers[i, 0], begin, size)
                if status == DECLINED:
                    status = call_step(steppers[i, 3], steppers[i, 2], begin, size)
                if status < 0 or status > 1:
                    failed[2] = status
                    return k, STEP
                clock[0] = times[k + 1]
                for g in range(first_getter[i], first_getter[i + 1]):
                    status = get_all(getters[g], values, references, integers)
                    if status < 0 or status > 1:
                        failed[1], failed[2] = g - first_getter[i], status
                        return k, GET
                    if getters[g, KIND] == 0 and getters[g, NATIVE] == 0:
                        for column in range(getters[g, FIRST], getters[g, FIRST] + getters[g, SIZE]):
                            if not np.isfinite(values[column]):
                                failed[1] = g - first_getter[i]
                                return k, NOT_FINITE
                since[i], reached[i] = times[k + 1], end
        turn[0] = number
        rows[k, :] = values
    return rows.shape[0], FINISHED


def group_table(
    groups: list[Sequence[InputGroup | OutputGroup]], calls: list[tuple[int, int]], references: list[int]
) -> tuple[IntTable, IntTable]:
    """Return the table of all groups and, by component, the row of its first one; `references` collects theirs.

    `calls` has for each component its FMI handle and the address of its values, 0 if it is not native.
    """
    rows, first = [], [0]
    for own, (handle, values) in zip(groups, calls, strict=True):
        for group in own:
            kind, variables = KINDS[group.counts_values][group.type], len(group.value_references)
            native = values if group.type == "Real" and variables == group.size else 0  # scalars
            rows.append(
                (kind, group.first, group.size, len(references), variables, native, handle, address(group.call))
            )
            references += group.value_references + (group.sizes if group.counts_values else [])
        first.append(len(rows))
    return np.array(rows, np.int64).reshape(-1, 8), np.array(first, np.int64)


def mapping_table(plan: Schedule) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.bool_]]:
    """Return the first entry of each copy (copies + 1), the entries (n, 2), source and target, in increasing order, and
    which copies take no other values (copies).
    """
    first, entries = [0], []
    for copy in range(len(plan.labels)):
        mapping = plan.mappings.get(copy)
        entries += [] if mapping is None else sorted(mapping.table.items())
        first.append(len(entries))
    partial = [copy in plan.mappings and not plan.mappings[copy].keeps for copy in range(len(plan.labels))]
    table = np.array(entries, np.float64).reshape(-1, 2)
    return np.array(first, np.int64), table, np.array(partial, np.bool_)


def address(function: object) -> int:
    """Return the address of a C function that ctypes has loaded."""
    return ctypes.cast(function, ctypes.c_void_p).value or 0  # type: ignore[arg-type]


def is_cached() -> bool:
    """Tell whether the compiled steps lie in numba's cache, so that the first run need not compile them."""
    return bool(run_steps._cache._cache_file._load_index())  # empty for another source or version of numba


class CompiledLoop:
    """Runs the steps of a schedule like `PythonLoop`."""

    def __init__(self, execution: Execution):
        plan = execution.schedule
        self._ports = [port for port in execution.ports if isinstance(port, Ports)]
        references: list[int] = []
        natives = [native_access(port.instance) for port in self._ports]
        handles = [port.instance.handle or 0 for port in self._ports]
        calls = [(handle, native.values) for handle, native in zip(handles, natives, strict=True)]
        setters, first_setter = group_table([port.inputs for port in self._ports], calls, references)
        getters, first_getter = group_table([port.outputs for port in self._ports], calls, references)
        steps = []
        for port, handle, native in zip(self._ports, handles, natives, strict=True):
            fmi = handle, port.instance.stepper
            steps.append((native.values, native.do_step, *fmi) if native.do_step else fmi * 2)
        self.steppers = np.array(steps, np.int64).reshape(-1, 4)
        """See `Calls`."""
        widest = max([1, *setters[:, SIZE], *getters[:, SIZE]])
        self._schedule, self._clock, self._row = plan, execution.clock, execution.row
        self._failed = np.zeros(3, np.int64)
        first_entry, entries, partial = mapping_table(plan)
        self._plan = Plan(
            driven=execution.driven,
            driven_every=execution.driven_every,
            order=plan.order,
            stage_order=plan.stage_order,
            stage_copies=plan.stage_copies,
            destination=plan.destination,
            source=plan.source,
            factor=plan.factor,
            offset=plan.offset,
            middle=plan.middle,
            owner=plan.owner,
            every=plan.every,
            copy_every=plan.copy_every,
            first_entry=first_entry,
            entries=entries,
            partial=partial,
        )
        self._state = State(
            values=self._row,
            last=self._row.copy(),
            samples=execution.samples,
            turn=execution.turn,
            reached=execution.reached,
            since=execution.since,
            clock=execution.clock,
            failed=self._failed,
        )
        self._calls = Calls(
            steppers=self.steppers,
            setters=setters,
            first_setter=first_setter,
            getters=getters,
            first_getter=first_getter,
            references=np.array(references, np.uint32),
            changed=np.zeros(widest, np.uint32),
            reals=np.zeros(widest),
            integers=np.zeros(2 * widest, np.int32),
        )

    def run(
        self,
        times: NDArray[np.float64],
        step_size: float,
        inputs: NDArray[np.float64],
        rows: NDArray[np.float64],
        stop: NDArray[np.bool_],
    ) -> tuple[int, TwipError | None]:
        """Do one step from each of `times` (n + 1,) but the last; see `PythonLoop.run`."""
        done, ending = run_steps(times, step_size, inputs, rows, stop, self._plan, self._state, self._calls)
        return done, None if ending in (FINISHED, STOPPED) else self._failure(ending)

    def _failure(self, ending: int) -> TwipError:
        component, group, status = self._failed.tolist()
        if ending in (UNMAPPED, OVERFLOWN):
            plan = self._schedule
            value = float(self._row[plan.destination[component]])
            if ending == UNMAPPED:
                value = float(plan.factor[component] * self._row[plan.source[component]] + plan.offset[component])
            return plan.refusal(component, value, float(self._clock[0]))
        port = self._ports[component]
        try:
            if ending == NOT_FINITE:
                port.refuse(port.outputs[group])
            groups: Sequence[InputGroup | OutputGroup] = port.inputs if ending == SET else port.outputs
            if ending == STEP:
                port.instance.check_step(status)
            if status == UNFIT and ending == SET:
                port.refuse_input(port.inputs[group])
            if status == UNFIT:
                port.outputs[group].read(port.instance.handle)  # into the plain loop's buffer
                port.refuse(port.outputs[group])
            port.instance.check(groups[group].function, status)
        except TwipError as failure:
            return failure
        raise RuntimeError(f"status {status} is no failure")
