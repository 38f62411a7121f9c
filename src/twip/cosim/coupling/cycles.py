"""Components that act on each other over a step: cycles of connections, whether or not they are algebraic loops."""

from collections.abc import Mapping, Sequence

from .feedthrough import Output, strongly_connected


def split(order: Sequence[str], sources: Mapping[tuple[str, str], Output]) -> list[tuple[list[str], bool]]:
    """Return the components of `order` in blocks, and whether a block is a cycle.

    A block comes after all those that feed it. A component that is in no cycle is a block of its own. `sources` maps a
    connected input to the output that feeds it; inside a block, and between blocks that leave the choice, `order`
    decides.
    """
    position = {name: i for i, name in enumerate(order)}
    feeders: dict[str, set[str]] = {name: set() for name in order}
    for (component, _), (source, _) in sources.items():
        feeders[component].add(source)
    # numbers of fixed width instead of names: the groups are sought in the order of their sorted nodes
    keys = {name: f"{position[name]:09d}" for name in order}
    groups = strongly_connected({keys[name]: sorted(keys[f] for f in feeders[name]) for name in order})
    blocks = []
    for group in groups:
        names = [order[int(key)] for key in sorted(group)]
        blocks.append((names, len(names) > 1 or names[0] in feeders[names[0]]))
    return blocks
