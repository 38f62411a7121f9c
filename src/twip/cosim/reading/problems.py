"""Collects what is wrong with a system, so that all of it is told at once."""

import dataclasses
from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from ...errors import Place, Problem, TwipError, clear

__all__ = ["Checking", "Place", "Problem", "Problems"]


class Problems:
    """An ordered collection of problems; what reads the same is kept once. Warnings are kept beside them."""

    def __init__(self) -> None:
        self._found: dict[str, Problem] = {}
        self._warnings: dict[str, Place | None] = {}
        self._added = 0
        self._caught: TwipError | None = None

    def __bool__(self) -> bool:
        return bool(self._found)

    def __iter__(self) -> Iterator[Problem]:
        """Yield the problems in the order they were found."""
        return iter(self._found.values())

    def add(self, message: str, place: Place | None = None, *, rule: str = "") -> None:
        """Add one problem, with the `rule` in words that follow the message; line breaks become spaces."""
        self.take([Problem(" ".join(message.split()), place, " ".join(rule.split()))])

    def take(self, problems: Iterable[str | Problem], place: Place | None = None) -> None:
        """Take over problems; those that have no place of their own are at `place`."""
        for one in problems:
            problem = Problem(one) if isinstance(one, str) else one
            if problem.place is None and place is not None:
                problem = dataclasses.replace(problem, place=place)
            self._found.setdefault(str(problem), problem)
            self._added += 1

    @contextmanager
    def catch(self, place: Place | None = None) -> Iterator[None]:
        """Take over the problems of a `TwipError`, which ends the block; those without a place are at `place`."""
        try:
            yield
        except TwipError as error:
            self.take(error.problems, place)
            self._caught = error

    def checking(self) -> "Checking":
        """Return what tells whether a problem is added from here on."""
        return Checking(self, self._added)

    @property
    def added(self) -> int:
        """How often a problem was added, the same one counted again."""
        return self._added

    def warn(self, message: str, place: Place | None = None) -> None:
        """Add a warning about what is odd or ignored, yet allowed; of the same message the first place is kept."""
        self._warnings.setdefault(clear(" ".join(message.split())), place)

    @property
    def warnings(self) -> list[str]:
        """The warnings in the order they were found."""
        return [text if place is None else f"{text} ({place})" for text, place in self._warnings.items()]

    @property
    def lines(self) -> list[str]:
        """The problems as text, in the order they were found."""
        return list(self._found)

    def raise_any(self) -> None:
        """Raise one `TwipError` with the problems, if there are any; one that was caught, of whatever kind, is raised
        again where it tells them all.
        """
        if self._caught is not None and self._caught.problems == tuple(self):
            raise self._caught
        if self._found:
            raise TwipError(self)


@dataclasses.dataclass(frozen=True)
class Checking:
    """A check that has begun."""

    problems: Problems
    begin: int
    """How often a problem had been added before."""

    @property
    def failed(self) -> bool:
        """Whether a problem has been added since, be it one that is known already."""
        return self.problems.added > self.begin
