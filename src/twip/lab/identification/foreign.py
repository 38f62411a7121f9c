"""Bench data from MCAP files that twip has not written: each quantity a signal `topic.field`."""

from pathlib import Path

import numpy as np

from ...errors import TwipError
from ..recordings import open_log
from .columns import Columns, parse_column
from .recording import Array


def read_foreign(path: Path, columns: Columns) -> tuple[dict[str, Array], Columns]:
    """Return the quantities the user names, under their own names, and what then is to say about their columns.

    All are at the times of the current's messages where every signal has begun and none has ended; those of other
    topics are interpolated. Time is the log time in s unless a signal is named for it. Raises TwipError when a signal
    is not there or none is named for the current.
    """
    log = open_log(path)
    wanted = {quantity: parse_column(quantity, text) for quantity, text in columns.given.items()}
    if "current" not in wanted:
        raise TwipError(f"{path}: it is not a log of twip: name the current by --current; {log.overview()}")
    series = log.series(name for name, _ in wanted.values())
    times = series[wanted["current"][0]].times
    begin = max(found.times[0] for found in series.values())
    end = min(found.times[-1] for found in series.values())
    times = times[(times >= begin) & (times <= end)]
    signals: dict[str, Array] = {"time": times}
    for quantity, (name, _) in wanted.items():
        signals[quantity] = np.interp(times, series[name].times, series[name].values)
    return signals, Columns(
        {quantity: f"{quantity}:{unit}" if unit else quantity for quantity, (_, unit) in wanted.items()}
    )
