"""The runs of a sweep sorted into the cells of a picture: the classes of an axis, and a group per parameter set."""

import itertools
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .parquet import Results
from .statistics import Array

MOST_TICKS = 24
BINS = 8
"""Classes of an axis that was sampled from a distribution."""


class Classes:
    """The values of an axis as classes: each value of a list or grid, or intervals of equal width of a distribution."""

    def __init__(self, results: Results, name: str):
        axis = next((a for a in results.description["axes"] if a["label"] == name), None)
        self.name = results.titled(name)
        column = results.columns[name]
        self._edges: Array | None = None
        self._known: list[Any] = []
        if axis is not None and axis["distribution"] is not None:
            values = results.numbers(name)
            self._edges = np.linspace(np.min(values), np.max(values), BINS + 1)
            self.index = np.clip(np.searchsorted(self._edges, values, side="right") - 1, 0, BINS - 1)
            self.count = BINS
        else:
            known = list(dict.fromkeys(column))
            if all(isinstance(v, int | float) for v in known):
                known.sort()
            self.index = np.array([known.index(v) for v in column])
            self.count = len(known)
            self._known = known

    @property
    def texts(self) -> list[str]:
        """What to call each class."""
        if self._edges is not None:
            return [f"{low:.3g} to {high:.3g}" for low, high in itertools.pairwise(self._edges)]
        short = [f"{v:.3g}" if isinstance(v, float) else str(v) for v in self._known]
        return short if len(set(short)) == len(short) else [str(v) for v in self._known]

    def label(self, axis: Any) -> None:
        """Put ticks and a name on an axis on which class i covers i to i + 1."""
        if self._edges is not None:
            axis.set_ticks(range(self.count + 1), [f"{e:.3g}" for e in self._edges])
        else:
            every = math.ceil(self.count / MOST_TICKS)
            axis.set_ticks([i + 0.5 for i in range(0, self.count, every)], self.texts[::every])
        if axis.axis_name == "x":
            axis.axes.tick_params(axis="x", rotation=60 if self.count > 8 else 0)
        axis.set_label_text(self.name)


def groups(results: Results, drawn: set[str]) -> Iterator[tuple[str, Any]]:
    """Give label and rows of each parameter set, or of all runs where there is none or it is an axis of the picture."""
    column = results.columns.get("parameters")
    if column is None or "parameters" in drawn:
        yield "", np.ones(len(results.columns["run"]), bool)
    else:
        for label in dict.fromkeys(column):
            yield str(label), np.array([v == label for v in column])


def cell_counts(chosen: Any, across: Classes, down: Classes) -> NDArray[np.int64]:
    """Return how many of some runs are in each cell (down, across)."""
    counts = np.zeros((down.count, across.count), np.int64)
    np.add.at(counts, (down.index[chosen], across.index[chosen]), 1)
    return counts


def cell_means(values: Array, chosen: Any, across: Classes, down: Classes) -> Array:
    """Return the mean of the finite values in each cell (down, across) of some runs, nan where there are none."""
    means = np.full((down.count, across.count), np.nan)
    for i in range(down.count):
        for j in range(across.count):
            inside = chosen & (down.index == i) & (across.index == j) & np.isfinite(values)
            if np.any(inside):
                means[i, j] = np.mean(values[inside])
    return means
