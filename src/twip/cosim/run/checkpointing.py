"""Takes a run to the state of a checkpoint, and writes that of a run."""

from collections.abc import Sequence

import numpy as np

from ...errors import TwipError
from ..coupling.execution import Execution
from ..fmus.protocols import AnyPorts
from ..values.strings import text_of
from .checkpoint import Checkpoint
from .run_state import RunState


def restore(run: RunState, checkpoint: Checkpoint, ports: Sequence[AnyPorts]) -> None:
    """Put the states of a checkpoint into the instances, and see whether they show its values again."""
    run.clock[0] = run.time_of(run.steps)
    names = run.system.columns
    saved_row = checkpoint.row.tolist()
    run.values[:] = saved_row
    run.faults.restore(checkpoint.delayed)
    for instance, port, state in zip(run.instances, ports, checkpoint.states, strict=True):
        instance.restore_state(state)
        port.read_inputs()
        port.get_outputs()
    for name, value, saved in zip(names, run.values, saved_row, strict=False):
        if value != saved:
            raise TwipError(
                f"{name} = {value!r} after its component's state was restored from the checkpoint, where it was"
                f" {saved!r}: the FMU does not save its whole state"
            )
    run.values[:] = saved_row
    run.say("info", f"resumed from a checkpoint at t = {run.clock[0]:.12g} s")


def save(run: RunState, execution: Execution) -> None:
    """Write a checkpoint, unless it is there already."""
    if run.saving is None or run.saved == run.steps:
        return
    row, samples = execution.row.copy(), execution.samples.copy()
    texts = {column: text_of(row[column]) for column in run.texts}
    row[run.texts] = 0.0
    samples[:, np.isin(run.schedule.source, run.texts)] = 0.0
    checkpoint = Checkpoint(
        run.identity,
        run.steps,
        run.digest.until(run.steps),
        row,
        samples,
        run.faults.memory,
        tuple(instance.save_state() for instance in run.instances),
        texts,
    )
    checkpoint.write(run.saving.path)
    run.saved = run.steps
