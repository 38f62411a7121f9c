"""Signal dictionaries: connectors of all references to a dictionary share its signals (SSP 1.0 section 5.3.3).

A connector of a reference to which a value is connected gives it to the signal of its name; one from which a value is
taken has it from the signal. Units are converted on the way.
"""

from collections.abc import Mapping

from ..reading.problems import Problems
from ..values.names import Key, full_name
from ..values.units import lookup
from .bindings import find
from .links import Edge, Port
from .ssb import SignalDictionary, read_signal_dictionary
from .structure import Connection, DictionaryElement, DictionaryReference, SystemElement, join

Around = tuple[tuple[str, SystemElement], ...]
"""A system's path and the system, for all systems around an element, the outermost one first."""


class Dictionaries:
    """All references to signal dictionaries in a system."""

    def __init__(self, problems: Problems):
        self._problems = problems
        self._read: dict[int, SignalDictionary | None] = {}
        self._signals: dict[Key, Port] = {}
        self._connectors: list[tuple[Port, Port]] = []

    def find(self, reference: DictionaryReference, around: Around) -> tuple[str, SignalDictionary] | None:
        """Return the dictionary that a reference means, and its path: that of the nearest system around it."""
        for path, system in reversed(around):
            for element in system.dictionaries:
                if element.name == reference.dictionary:
                    dictionary = self._content(element)
                    return None if dictionary is None else (f"dictionary {join(path, element.name)}", dictionary)
        self._problems.add(f"{reference.name}: there is no signal dictionary {reference.dictionary}", reference.place)
        return None

    def add(self, port: Port, path: str, dictionary: SignalDictionary) -> None:
        """Add a connector of a reference to the dictionary at `path`."""
        entry = dictionary.entries.get(port.key[1])
        if entry is None:
            self._problems.add(f"connector {full_name(port.key)}: {path} has no such entry", port.place)
            return
        key = (path, entry.name)
        if key not in self._signals:
            items = dictionary.enumerations.get(entry.type.enumeration or "")
            if items is None and entry.type.enumeration is not None:
                self._problems.add(f"enumeration {entry.type.enumeration} has no definition", entry.place)
            self._signals[key] = Port(
                key, "inout", entry.type.type, lookup(entry.type.unit, dictionary.units), None, entry.place,
                () if items is None else items.items, True,
            )  # fmt: skip
        self._connectors.append((port, self._signals[key]))

    def read(self, system: SystemElement) -> None:
        """Read the dictionaries of a system, whether something refers to them or not."""
        for element in system.dictionaries:
            self._content(element)

    def _content(self, element: DictionaryElement) -> SignalDictionary | None:
        if id(element) not in self._read:
            found = find(element.content, element.document, None, self._problems)
            self._read[id(element)] = None if found is None else read_signal_dictionary(*found, self._problems)
        return self._read[id(element)]

    def signals(self) -> list[Port]:
        """Return a port for each signal that something refers to."""
        return list(self._signals.values())

    def edges(self, connections: Mapping[Key, Edge]) -> list[Edge]:
        """Return the edges between connectors and signals; `connections` are those of the systems, by target."""
        read = {edge.source.key for edge in connections.values()}
        edges = []
        for port, signal in self._connectors:
            if port.key in connections:
                source, target = port, signal
            elif port.key in read:
                source, target = signal, port
            else:
                continue
            edges.append(Edge(source, target, Connection(source.key, target.key, None, False, port.place)))
        return edges
