"""Evaluation order from the direct feed-through that model descriptions declare.

An output that depends on no connected input has depth 0; any other has depth 1 + the largest depth among the sources of
the inputs it depends on. A component's rank is 0 without connected inputs, else 1 + the largest depth among all its
sources. Components run by rank, then by name, so that the order in the file has no influence. Outputs that depend on
each other form an algebraic loop and share one depth, which is also the rank that a loop gives its members: they run
by name, and before whatever follows the loop.
"""

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

Output = tuple[str, str]
"""Component and variable."""
Feedthrough = Mapping[str, Mapping[str, frozenset[str]]]
"""For each component and each output of it, the inputs it depends on."""
Node = TypeVar("Node", str, int)


@dataclass(frozen=True)
class Order:
    """Components in the order of evaluation, and the algebraic loops found on the way."""

    components: tuple[str, ...]
    loops: tuple[tuple[Output, ...], ...]
    """The outputs of each loop."""
    paths: tuple[str, ...]
    """A way around each loop: `a.y → b.u → b.y → a.u`, and what else is in it."""


class _Graph:
    """What each output depends on, by number: first the outputs in the order of their names, then sets of inputs.

    Outputs of a component with the same dependencies, such as those of an array, share one set: n outputs of n inputs
    make 2 n edges, not n².
    """

    def __init__(self, feedthrough: Feedthrough, sources: Mapping[tuple[str, str], Output]):
        self.feedthrough = feedthrough
        self.sources = sources
        self.outputs = sorted((component, output) for component, own in feedthrough.items() for output in own)
        self.number = {output: i for i, output in enumerate(self.outputs)}
        numbers: dict[tuple[str, frozenset[str]], int] = {}
        for component, output in self.outputs:
            numbers.setdefault((component, feedthrough[component][output]), len(self.outputs) + len(numbers))
        self.edges = {i: [numbers[c, feedthrough[c][output]]] for i, (c, output) in enumerate(self.outputs)}
        for (component, inputs), i in numbers.items():
            fed = (sources[component, name] for name in inputs if (component, name) in sources)
            self.edges[i] = sorted({self.number[source] for source in fed})

    def is_set(self, node: int) -> bool:
        return node >= len(self.outputs)

    def way_around(self, loop: list[int]) -> str:
        """Return the shortest way from the first output of `loop` back to it, in the direction of the signals."""
        first, inside = loop[0], set(loop)
        after: dict[int, int] = {}  # the output that is computed from this one, on the way to the first
        queue, passed = deque([first]), set[int]()
        while queue and first not in after:
            node = queue.popleft()
            (inputs,) = self.edges[node]
            for source in () if inputs in passed else self.edges[inputs]:
                if source in inside and source not in after:
                    after[source] = node
                    queue.append(source)
            passed.add(inputs)
        way = [first]
        while (following := after[way[-1]]) != first:
            way.append(following)
        names = []
        for source, node in zip(way, [*way[1:], first], strict=True):
            feeder, (component, output) = self.outputs[source], self.outputs[node]
            taken = min(i for i in self.feedthrough[component][output] if self.sources.get((component, i)) == feeder)
            names += [".".join(feeder), f"{component}.{taken}"]
        inside -= set(way)
        others = [".".join(self.outputs[node]) for node in loop if node in inside]
        return " → ".join(names) + (f" (and with them {', '.join(others)})" if others else "")


def evaluation_order(feedthrough: Feedthrough, sources: Mapping[tuple[str, str], Output]) -> Order:
    """Return the order for components with the given `feedthrough` (component → output → inputs it depends on).

    `sources` maps a connected input to the output that feeds it.
    """
    graph = _Graph(feedthrough, sources)
    groups = strongly_connected(graph.edges)
    group_of = {node: index for index, group in enumerate(groups) for node in group}
    depth = [0] * len(groups)
    behind: dict[int, int] = {}  # largest depth of what feeds a set of inputs
    for index, group in enumerate(groups):  # sources come before what depends on them
        sets = [node for node in group if graph.is_set(node)]
        if len(group) > 1:
            outside = [depth[group_of[s]] for node in sets for s in graph.edges[node] if group_of[s] != index]
            depth[index] = 1 + max(outside, default=0)
        elif not sets:
            depth[index] = 1 + behind[graph.edges[group[0]][0]]
        for node in sets:
            behind[node] = max((depth[group_of[s]] for s in graph.edges[node]), default=-1)
    members = [{graph.outputs[node][0] for node in group if not graph.is_set(node)} for group in groups]
    rank = dict.fromkeys(feedthrough, 0)
    for (component, _), source in sources.items():
        index = group_of[graph.number[source]]
        rank[component] = max(rank[component], depth[index] + (0 if component in members[index] else 1))
    loops = sorted(sorted(node for node in group if not graph.is_set(node)) for group in groups if len(group) > 1)
    return Order(
        tuple(sorted(feedthrough, key=lambda name: (rank[name], name))),
        tuple(tuple(graph.outputs[node] for node in loop) for loop in loops),
        tuple(map(graph.way_around, loops)),
    )


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
