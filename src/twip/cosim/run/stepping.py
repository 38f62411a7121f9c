"""Takes a run from its first row to its last, in equal or in variable steps."""

import numpy as np

from ..coupling.execution import Execution
from ..coupling.loop import PythonLoop
from ..coupling.variable_loop import VariableLoop
from ..scenario.plan import ParameterChange
from .checkpointing import save
from .run_state import Loop, RunState

CHUNK = 200
"""Most steps between two deliveries to the sinks."""


def prepare_loop(run: RunState, execution: Execution) -> Loop:
    """Return the loop, compiled; where numba cannot keep what it compiles, the plain one, which gives the same."""
    loop = run.loop.make(execution)
    times, none = run.grid.times(run.steps, 0), np.zeros((0, len(execution.driven)))
    try:
        loop.run(times, run.grid.step_size, none, np.empty((0, run.schedule.columns)), run.interrupted.array)
    except OSError as error:  # no step is done here: it is numba that writes
        run.say("warning", f"the loop runs uncompiled: numba's cache cannot be written ({error.strerror or error})")
        return PythonLoop(execution)
    return loop


def advance_freely(run: RunState, execution: Execution) -> None:
    """Go with variable steps from event to event: jumps and corners of the inputs, and parameter changes."""
    loop = VariableLoop(execution, run.grid, run.coupling, run.system, run.inputs)
    run.variable = loop.steps
    changes = list(run.scenario.changes)
    for until in run.grid.events(run.inputs.events() | {change.time for change in changes}):
        run.clock[0] = loop.time
        while changes and changes[0].time < loop.time + run.grid.resolution:
            _set(run, changes.pop(0))
        while loop.time < until and not run.interrupted:
            times, rows, failure = loop.run(until, CHUNK, run.interrupted.array)
            run.steps += len(times)
            run.reached = loop.time
            run.tell_refusals()
            run.delivery.write(np.array(times), np.array(rows).reshape(-1, run.schedule.columns))
            run.progress(loop.time)
            if failure is not None:
                raise failure


def advance(run: RunState, loop: Loop, execution: Execution) -> None:
    """Go with equal steps from change to change: parameters, faults and checkpoints."""
    grid, last = run.grid, run.grid.steps
    longest = CHUNK if run.pacer is None else min(CHUNK, run.pacer.chunk(grid.step_size))
    if run.pacer is not None:
        run.pacer.start(run.time_of(run.steps))
    while run.steps < last and not run.interrupted:
        due = last if run.saving is None else run.saving.next(run.steps, last)
        _change(run, execution)
        count = min(longest, _undisturbed(run, due) - run.steps)
        times = grid.times(run.steps, count)
        inputs = np.hstack([run.inputs.at(times[:-1], grid.step_size), run.faults.past(count)])
        rows = np.empty((count, run.schedule.columns))  # anew for each chunk: a sink may keep it
        done, failure = loop.run(times, grid.step_size, inputs, rows, run.interrupted.array)
        run.steps += done
        run.reached = float(times[done])
        run.faults.record(rows[:done])
        if run.pacer is not None:
            run.pacer.wait(float(times[done]), run.interrupted)
        run.tell_refusals()
        run.delivery.write(times[1 : done + 1], rows[:done, : run.faults.recorded])
        run.progress(float(times[done]))
        if failure is not None:
            raise failure
        if run.steps == due:
            save(run, execution)
    if run.pacer is not None:
        run.say("info", f"real time: {run.pacer.report}")
    save(run, execution)


def _change(run: RunState, execution: Execution) -> None:
    """Do what the scenario wants done between the last step and the next."""
    run.clock[0] = run.time_of(run.steps)
    for change in run.scenario.changes:
        if change.step == run.steps:
            _set(run, change)
    for text in run.faults.begin(run.steps, execution.row):
        run.say("info", text)


def _set(run: RunState, change: ParameterChange) -> None:
    run.say("info", str(change))
    run.instances[change.component].set_value(change.value)


def _undisturbed(run: RunState, last: int) -> int:
    """Return after how many steps, at most `last`, the scenario wants something done again."""
    changes = (change.step for change in run.scenario.changes if change.step > run.steps)
    return run.faults.until(run.steps, min(last, *changes, last))
