"""Collects what is wrong with a system, so that all of it is told at once."""

from dataclasses import dataclass

from ...errors import TwipError, clear


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


class Problems:
    """An ordered collection of one-line problems; the same line is kept once. Warnings are kept beside them."""

    def __init__(self) -> None:
        self._lines: dict[str, None] = {}
        self._warnings: dict[str, Place | None] = {}

    def __bool__(self) -> bool:
        return bool(self._lines)

    def add(self, message: str, place: Place | None = None) -> None:
        """Add one problem; line breaks inside `message` become spaces."""
        text = clear(" ".join(message.split()))
        self._lines[text if place is None else f"{text} ({place})"] = None

    def warn(self, message: str, place: Place | None = None) -> None:
        """Add a warning about what is odd or ignored, yet allowed; of the same message the first place is kept."""
        self._warnings.setdefault(clear(" ".join(message.split())), place)

    @property
    def warnings(self) -> list[str]:
        """The warnings in the order they were found."""
        return [text if place is None else f"{text} ({place})" for text, place in self._warnings.items()]

    @property
    def lines(self) -> list[str]:
        """The problems in the order they were found."""
        return list(self._lines)

    def raise_any(self) -> None:
        """Raise one `TwipError` with a line per problem, if there are any."""
        if self._lines:
            raise TwipError("\n".join(self._lines))
