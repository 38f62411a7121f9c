"""Evaluation order from the direct feed-through that model descriptions declare.

An output that depends on no connected input has depth 0; any other has depth 1 + the largest depth among the sources of
the inputs it depends on. A component's rank is 0 without connected inputs, else 1 + the largest depth among all its
sources. Components run by rank, then by name, so that the order in the file has no influence. Outputs that depend on
each other form an algebraic loop and share one depth, which is also the rank that a loop gives its members: they run
by name, and before whatever follows the loop.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

Output = tuple[str, str]
"""Component and variable."""
Node = TypeVar("Node", str, Output)


@dataclass(frozen=True)
class Order:
    """Components in the order of evaluation, and the algebraic loops found on the way."""

    components: tuple[str, ...]
    loops: tuple[tuple[Output, ...], ...]
    """The outputs of each loop."""
    paths: tuple[str, ...]
    """A way around each loop: `a.y → b.u → b.y → a.u`, and what else is in it."""


def evaluation_order(
    feedthrough: Mapping[str, Mapping[str, frozenset[str]]], sources: Mapping[tuple[str, str], Output]
) -> Order:
    """Return the order for components with the given `feedthrough` (component → output → inputs it depends on).

    `sources` maps a connected input to the output that feeds it.
    """
    graph = {
        (component, output): sorted({sources[component, name] for name in inputs if (component, name) in sources})
        for component, outputs in feedthrough.items()
        for output, inputs in outputs.items()
    }
    groups = strongly_connected(graph)
    group_of = {node: index for index, group in enumerate(groups) for node in group}
    depth: dict[int, int] = {}
    for index, group in enumerate(groups):  # sources come before what depends on them
        outside = [depth[group_of[s]] for node in group for s in graph[node] if group_of[s] != index]
        looped = len(group) > 1 or group[0] in graph[group[0]]
        depth[index] = 1 + max(outside, default=0 if looped else -1)
    rank = dict.fromkeys(feedthrough, 0)
    for (component, _), source in sources.items():
        inside = any(name == component for name, _ in groups[group_of[source]])
        rank[component] = max(rank[component], depth[group_of[source]] + (0 if inside else 1))
    loops = sorted(tuple(sorted(group)) for group in groups if len(group) > 1 or group[0] in graph[group[0]])
    return Order(
        tuple(sorted(feedthrough, key=lambda name: (rank[name], name))),
        tuple(loops),
        tuple(_path(loop, graph, feedthrough, sources) for loop in loops),
    )


def _path(
    loop: tuple[Output, ...],
    graph: Mapping[Output, list[Output]],
    feedthrough: Mapping[str, Mapping[str, frozenset[str]]],
    sources: Mapping[tuple[str, str], Output],
) -> str:
    """Return the shortest way from the first output of `loop` back to it, in the direction of the signals."""
    first = loop[0]
    after: dict[Output, Output] = {}  # the output that is computed from this one, on the way to the first
    queue = [first]
    while queue and first not in after:
        node = queue.pop(0)
        for source in graph[node]:
            if source in loop and source not in after:
                after[source] = node
                queue.append(source)
    outputs = [first]
    while (following := after[outputs[-1]]) != first:
        outputs.append(following)
    names = []
    for source, (component, output) in zip(outputs, [*outputs[1:], first], strict=True):
        taken = min(i for i in feedthrough[component][output] if sources.get((component, i)) == source)
        names += [".".join(source), f"{component}.{taken}"]
    others = [".".join(output) for output in loop if output not in outputs]
    return " → ".join(names) + (f" (and with them {', '.join(others)})" if others else "")


def strongly_connected(graph: Mapping[Node, list[Node]]) -> list[list[Node]]:
    """Return the strongly connected components, each after those it points to (Tarjan 1972, without recursion)."""
    number: dict[Node, int] = {}
    low: dict[Node, int] = {}
    stack: list[Node] = []
    on_stack: set[Node] = set()
    groups: list[list[Node]] = []
    for root in sorted(graph):
        if root in number:
            continue
        work = [(root, iter(graph[root]))]
        while work:
            node, successors = work[-1]
            if node not in number:
                number[node] = low[node] = len(number)
                stack.append(node)
                on_stack.add(node)
            for successor in successors:
                if successor not in number:
                    work.append((successor, iter(graph[successor])))
                    break
                if successor in on_stack:
                    low[node] = min(low[node], number[successor])
            else:
                work.pop()
                if work:
                    low[work[-1][0]] = min(low[work[-1][0]], low[node])
                if low[node] == number[node]:
                    group: list[Node] = []
                    while not group or group[-1] != node:
                        group.append(stack.pop())
                        on_stack.discard(group[-1])
                    groups.append(group)
    return groups
