"""Array connectors of SSP 2.0, expanded to one connector per element: `x[1]`, `x[2,1]`, counted from 1.

An FMU's array is known by the same names. A dimension without size has the size that the FMU's variables show. A
connection between arrays of one shape becomes one connection per element.
"""

import dataclasses
import itertools
import math
import re
from collections.abc import Iterable

from .fmu import Fmu
from .problems import Problems
from .structure import Connection, Connector, DictionaryReference, SystemElement, join

MAXIMUM_SIZE = 100_000
"""Most elements of an array."""
Shape = tuple[int, ...]
_ELEMENT = re.compile(r"(.+)\[([1-9][0-9]{0,8}(?:,[1-9][0-9]{0,8})*)\]")


def expand_arrays(system: SystemElement, fmus: dict[str, Fmu | None], problems: Problems, path: str = "") -> None:
    """Expand the array connectors of `system` and of everything in it, and the connections between them."""
    shapes: dict[tuple[str, str], Shape] = {}
    system.connectors = _expand(system.connectors, "", None, shapes, problems)
    for element in system.elements:
        if isinstance(element, SystemElement):
            for connector in element.connectors:
                _remember(connector, element.name, None, shapes, Problems())
            expand_arrays(element, fmus, problems, join(path, element.name))
        else:
            fmu = None if isinstance(element, DictionaryReference) else fmus.get(join(path, element.name))
            element.connectors = _expand(element.connectors, element.name, fmu, shapes, problems)
    system.connections = [c for connection in system.connections for c in _elementwise(connection, shapes, problems)]


def indices(shape: Shape) -> list[str]:
    """Return `[1]`, `[2]` and so on in row-major order, nothing for a scalar."""
    return [f"[{','.join(map(str, i))}]" if shape else "" for i in itertools.product(*(range(1, n + 1) for n in shape))]


def shapes_of(names: Iterable[str]) -> dict[str, Shape]:
    """Return the shapes of the arrays that are whole among `names`, by the names without indices."""
    found: dict[str, list[Shape]] = {}
    for name in names:
        if match := _ELEMENT.fullmatch(name):
            found.setdefault(match[1], []).append(tuple(map(int, match[2].split(","))))
    largest = {
        name: tuple(map(max, zip(*places, strict=True)))
        for name, places in found.items()
        if len({len(place) for place in places}) == 1
    }
    return {name: shape for name, shape in largest.items() if math.prod(shape) == len(set(found[name]))}


def _expand(
    connectors: list[Connector], owner: str, fmu: Fmu | None, shapes: dict[tuple[str, str], Shape], problems: Problems
) -> list[Connector]:
    expanded = []
    for connector in connectors:
        _remember(connector, owner, fmu, shapes, problems)
        shape = shapes.get((owner, connector.name), ())
        expanded += [
            dataclasses.replace(connector, name=connector.name + index, dimensions=()) for index in indices(shape)
        ]
    return expanded


def _remember(
    connector: Connector, owner: str, fmu: Fmu | None, shapes: dict[tuple[str, str], Shape], problems: Problems
) -> None:
    """Find the shape of an array connector."""
    if not connector.dimensions:
        return
    label = f"connector {owner}.{connector.name}" if owner else f"connector {connector.name}"
    sizes = [dimension.size for dimension in connector.dimensions]
    shown = None if fmu is None else _shape_in(fmu, connector.name, len(sizes))
    if None in sizes and shown is None:
        problems.add(f"{label}: the size of the array is not known", connector.place)
        shape: Shape = (1,) * len(sizes)
    else:
        shape = tuple(n if n is not None else m for n, m in zip(sizes, shown or (1,) * len(sizes), strict=True))
    if shown is not None and shape != shown:
        problems.add(f"{label}: is {shape_text(shape)}, but {shape_text(shown)} in the FMU", connector.place)
    if math.prod(shape) > MAXIMUM_SIZE:
        problems.add(f"{label}: more than {MAXIMUM_SIZE} elements", connector.place)
        shape = (1,) * len(sizes)
    shapes[owner, connector.name] = shape


def _shape_in(fmu: Fmu, name: str, dimensions: int) -> Shape | None:
    pattern = re.compile(re.escape(name) + r"\[" + ",".join([r"([1-9][0-9]{0,8})"] * dimensions) + r"\]")
    found = [tuple(map(int, match.groups())) for v in fmu.variables if (match := pattern.fullmatch(v))]
    return tuple(map(max, zip(*found, strict=True))) if found else None


def shape_text(shape: Shape) -> str:
    """Return sizes as a message shows them."""
    return " x ".join(map(str, shape)) or "a scalar"


def _elementwise(connection: Connection, shapes: dict[tuple[str, str], Shape], problems: Problems) -> list[Connection]:
    start, end = (shapes.get(side, ()) for side in (connection.start, connection.end))
    if start != end:
        problems.add(
            f"{'.'.join(filter(None, connection.start))} → {'.'.join(filter(None, connection.end))}: sizes differ"
            f" ({shape_text(start)}, {shape_text(end)})",
            connection.place,
        )
        return []
    return [
        dataclasses.replace(
            connection,
            start=(connection.start[0], connection.start[1] + index),
            end=(connection.end[0], connection.end[1] + index),
        )
        for index in indices(start)
    ]
