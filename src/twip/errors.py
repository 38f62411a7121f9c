"""What is wrong, as data, and the one exception that brings it to a user."""

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Self

LONGEST_LINE = 2000
"""Characters of a message's line; more than that comes from damaged input."""


def clear(line: str) -> str:
    """Return a line fit for a terminal: what is not printable is escaped, the middle of an endless one left out."""
    if len(line) > LONGEST_LINE:
        line = f"{line[: LONGEST_LINE // 4]} … {line[-LONGEST_LINE // 4 :]}"
    if line.isprintable():
        return line
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in line)


@dataclass(frozen=True)
class Place:
    """Where a problem was found; printed in brackets at the end of its line."""

    file: str
    """File name as the user knows it, or a phrase such as `start values`."""
    line: int | None = None
    component: str | None = None

    def __str__(self) -> str:
        where = self.file if self.line is None else f"{self.file} line {self.line}"
        return f"component {self.component}, {where}" if self.component else where


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong; its text is one line, `SUBJECT: TEXT RULE (PLACE)`, of what there is."""

    text: str
    """What is wrong, with the rule where that has no words of its own."""
    place: Place | None = None
    rule: str = ""
    """What must hold, in the words that follow the text: `must be a finite number`."""
    subject: str = ""
    """What the text is about where that comes before it: an option, a file, a key."""

    def __str__(self) -> str:
        line = f"{self.text} {self.rule}" if self.rule else self.text
        line = f"{self.subject}: {line}" if self.subject else line
        line = line if self.place is None else f"{line} ({self.place})"
        return clear(" ".join(line.split()) if "\n" in line else line)

    def about(self, subject: str) -> "Problem":
        """Return the problem with another subject."""
        return dataclasses.replace(self, subject=subject)


class TwipError(Exception):
    """A mistake in the user's input, or a failure of a component, told in one line per problem.

    Every line names what is wrong, where (component, file and line, or time in s) and the rule that was broken. The
    command line prints them without a traceback and exits with status 1. Callers read `problems`, not the text.
    """

    problems: tuple[Problem, ...]
    """What is wrong, in the order it was found; what reads the same is there once."""

    def __init__(self, problems: str | Problem | Iterable[str | Problem] = ()):
        given = [problems] if isinstance(problems, str | Problem) else problems
        found: dict[str, Problem] = {}
        for one in given:
            problem = Problem(one) if isinstance(one, str) else one
            found.setdefault(str(problem), problem)
        self.problems = tuple(found.values())
        super().__init__(self.problems)

    def __str__(self) -> str:
        return "\n".join(map(str, self.problems))

    def about(self, subject: str) -> Self:
        """Make `subject` what all problems are about, and return the error."""
        self.problems = tuple(problem.about(subject) for problem in self.problems)
        self.args = (self.problems,)
        return self


class AbsentFileError(TwipError):
    """There is no file at this path."""

    def __init__(self, problems: str | Problem | Iterable[str | Problem] = (), *, path: Path = Path()):
        super().__init__(problems)
        self.path = path
        """As it was asked for."""


class UnknownNameError(TwipError):
    """There is no signal, column or input of this name."""

    def __init__(
        self, problems: str | Problem | Iterable[str | Problem] = (), *, name: str = "", near: Iterable[str] = ()
    ):
        super().__init__(problems)
        self.name = name
        """What was asked for."""
        self.near = tuple(near)
        """Names that may have been meant, the likeliest first."""
