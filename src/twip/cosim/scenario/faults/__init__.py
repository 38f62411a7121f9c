"""The kinds of faults, one class in one file each. A new file is a new kind (docs/extending.md)."""

from functools import cache

from ...reading.family import members
from .base import Fault


@cache
def kinds() -> dict[str, type[Fault]]:
    """Return the kinds of faults by their names in scenario files, in the order in which messages list them."""
    found = [item for item in members(__name__, __path__) if issubclass(item, Fault)]
    return {item.kind: item for item in sorted(found, key=lambda item: (item.rank, item.kind))}
