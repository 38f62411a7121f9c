"""The order of a container's connections: each after those that its value depends on at initialization.

The container copies all connections once, one after the other, when initialization ends. In this order one pass brings
all initial values into agreement, unless they depend on each other in a circle.
"""

from collections.abc import Mapping, Sequence

from .nested import Connection, NestedFmu


def in_order_of_initialization(
    connections: Sequence[Connection], fmus: Mapping[str, NestedFmu]
) -> tuple[list[Connection], list[str]]:
    """Return the connections in order, and a sentence if initial values depend on each other in a circle."""
    fed = {c.destination for c in connections}
    needs = {
        c: {(c.source[0], name) for name in fmus[c.source[0]].depends(c.source[1], initially=True)} & fed
        for c in connections
    }
    waiting, done, ordered = list(connections), set[tuple[str, str]](), list[Connection]()
    circle: list[Connection] = []
    while waiting:
        ready = [c for c in waiting if needs[c] <= done]
        if not ready:
            circle = circle or list(waiting)
            ready = waiting[:1]
        pair = (ordered[-1].source[0], ordered[-1].destination[0]) if ordered else None
        chosen = next((c for c in ready if (c.source[0], c.destination[0]) == pair), ready[0])
        waiting.remove(chosen)
        done.add(chosen.destination)
        ordered.append(chosen)
    if not circle:
        return ordered, []
    names = ", ".join(".".join(c.destination) for c in circle)
    return ordered, [f"initial values that depend on each other are passed on once only: {names}"]
