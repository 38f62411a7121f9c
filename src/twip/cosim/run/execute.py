"""One run of a checked system: started, stepped to its end, and everything freed on the way out."""

import contextlib
import time

from ...errors import TwipError
from ..fmus.component import EndRequestedError
from ..fmus.sudden_end import sudden_end_told
from ..values.strings import text_of
from .results import Result
from .run_state import RunState
from .starting import start
from .stepping import advance, advance_freely, prepare_loop


def execute(run: RunState) -> Result:
    """Initialize, run, deliver, and free everything on the way out."""
    with sudden_end_told(run.folders, run.clock):
        return _execute(run)


def _execute(run: RunState) -> Result:
    begin = time.perf_counter()
    for warning in run.warnings:
        run.say("warning", warning)
    try:
        try:
            execution = start(run)
            loop = None if execution is None else prepare_loop(run, execution)
            started = time.perf_counter()
            if execution is not None and run.coupling.control is not None:
                advance_freely(run, execution)
            elif execution is not None and loop is not None:
                advance(run, loop, execution)
            run.completed = True
        except EndRequestedError as request:
            run.ended = str(request)
            run.say("info", run.ended)
        except TwipError as failure:
            run.say("error", str(failure))
            raise
    finally:
        stopped = time.perf_counter()
        _free(run)
    interrupted = bool(run.interrupted) and run.reached < run.grid.stop
    row = [text_of(v) if i in run.texts else v for i, v in enumerate(run.values)]
    values = dict(zip(run.system.columns, row, strict=False)) if run.delivered else {}
    return Result(
        steps=run.steps - run.first,
        start_time=run.time_of(run.first),
        time=run.reached,
        step_size=run.grid.step_size,
        coupling=run.schedule.coupling,
        wall_time=stopped - started,
        setup_time=started - begin,
        interrupted=interrupted,
        ended=run.ended,
        values=values,
        warnings=tuple(run.warnings),
        checkpoint=run.saving.path if run.saving is not None and run.saved is not None else None,
        signal=run.interrupted.signal if interrupted else None,
        real_time=run.pacer.report if run.pacer is not None else None,
        iterations=0 if execution is None else execution.iterations,
        variable=run.variable,
    )


def _free(run: RunState) -> None:
    """Free all instances, the last first, also when interrupted once more, and deliver their last messages."""
    run.delivery.end_copy()
    with contextlib.ExitStack() as closing:
        if run.isolation is not None:
            closing.callback(run.isolation.close)
        for instance in run.instances:
            closing.callback(run.pool.give_back, instance, run.completed)
    for folder in run.dead:
        run.system.unpacked.forget(folder)
    run.tell_refusals()
    run.delivery.tell()
