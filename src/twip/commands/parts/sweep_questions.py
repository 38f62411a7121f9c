"""What `twip sweep` is asked for besides its rows: pictures and full logs, checked before the first run."""

import argparse
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from ...errors import TwipError
from ...lab.sweep.keep import Keep
from ...lab.sweep.known import SUCCESS, Known, refuse
from ...lab.sweep.parquet import Results
from ...lab.sweep.pictures import draw_map, draw_rate, draw_sensitivity

KINDS = ("map", "rate", "sensitivity")
"""Of pictures."""


def picture_of(results: Path, kind: str) -> Path:
    """Return where a picture of results goes."""
    return results.with_name(f"{results.stem}-{kind}.png")


def logs_of(results: Path) -> Path:
    """Return the folder that full logs of runs go to."""
    return results.with_name(f"{results.stem}-runs")


def remove_earlier(results: Path) -> None:
    """Remove pictures and logs that an earlier sweep has left beside its results, which new ones have replaced.

    Raises TwipError for one that cannot be removed.
    """
    logs = [log for log in logs_of(results).glob("run-*.mcap") if log.stem.removeprefix("run-").isdecimal()]
    for file in (*(picture_of(results, kind) for kind in KINDS), *logs):
        try:
            file.unlink(missing_ok=True)
        except OSError as error:
            raise TwipError(f"{file}: it is of an earlier sweep and cannot be removed: {error.strerror}") from None


@dataclass(frozen=True)
class Questions:
    """The options `--map`, `--rate`, `--sensitivity` and `--keep`; None where one is not given."""

    map: tuple[str, str, str] | None
    rate: tuple[str, ...] | None
    sensitivity: str | None
    keep: Keep | None

    @classmethod
    def of(cls, arguments: argparse.Namespace) -> "Questions":
        """Return what the options ask. Raises `TwipError` for what cannot be understood."""
        problems = []
        over = arguments.map
        if over is not None and len(over) not in (2, 3):
            problems.append("--map takes two axes and perhaps a metric")
        keep = None
        try:
            keep = None if arguments.keep is None else Keep.parse(arguments.keep)
        except TwipError as error:
            problems.append(f"--keep {error}")
        refuse(problems)
        return cls(
            map=None if over is None else (*over, SUCCESS)[:3],
            rate=None if arguments.rate is None else tuple(arguments.rate),
            sensitivity=arguments.sensitivity,
            keep=keep,
        )

    @property
    def pictures(self) -> bool:
        """Whether anything is to be drawn."""
        return (self.map, self.rate, self.sensitivity) != (None, None, None)

    def check(self, known: Known) -> None:
        """Raise `TwipError` with a line for everything that a sweep cannot answer, as far as is known of it."""
        problems: list[str] = []

        def add(option: str, found: list[str]) -> None:
            problems.extend(f"--{option}: {text}" for text in found)

        if self.map is not None:
            add("map", known.axis_problems(self.map[:2]) + known.metric_problems(self.map[2]))
        if self.rate is not None:
            add("rate", known.axis_problems(self.rate) + known.metric_problems(SUCCESS))
        if self.sensitivity is not None:
            add("sensitivity", known.ranking_problems(self.sensitivity))
        if self.keep is not None:
            add("keep", self.keep.problems(known.runs, known.metrics if known.complete else None))
        refuse(problems)

    def draw(self, path: Path) -> Iterator[tuple[str, Path, list[str]]]:
        """Draw beside the results at `path`; give kind, picture and what it says in words, of each.

        Raises `TwipError` that names all that cannot be drawn, after the others.
        """
        if not self.pictures:
            return
        results = Results.read(path)
        self.check(Known.of_results(results))
        drawings: list[tuple[str, Callable[[Path], list[str] | None]]] = []
        if self.map is not None:
            x, y, what = self.map
            drawings.append(("map", lambda picture: draw_map(results, x, y, what, picture)))
        if (along := self.rate) is not None:
            drawings.append(("rate", lambda picture: draw_rate(results, along, picture)))
        if (metric := self.sensitivity) is not None:
            drawings.append(("sensitivity", lambda picture: draw_sensitivity(results, metric, picture)))
        problems = []
        for kind, draw in drawings:
            picture = picture_of(path, kind)
            try:
                yield kind, picture, draw(picture) or []
            except TwipError as error:
                problems.append(f"--{kind}: {error}")
        refuse(problems)
