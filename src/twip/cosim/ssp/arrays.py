"""Array connectors of SSP 2.0, expanded to one connector per element: `x[1]`, `x[2,1]`, counted from 1.

An FMU's array is known by the same names. A dimension without size has the size that the FMU's variables show. A
connection between arrays of one shape becomes one connection per element.
"""

import dataclasses
import math

from ..model.fmu import Fmu
from ..reading.problems import Problems
from ..values.shapes import Shape, indices, shape_text
from .structure import Connection, Connector, DictionaryReference, SystemElement, join

MAXIMUM_SIZE = 100_000
"""Most elements of an array."""
Shapes = dict[tuple[str, str], Shape | None]
"""By element and connector; None where only an FMU that cannot be used would tell."""


def expand_arrays(system: SystemElement, fmus: dict[str, Fmu | None], problems: Problems, path: str = "") -> None:
    """Expand the array connectors of `system` and of everything in it, and the connections between them."""
    shapes: Shapes = {}
    system.connectors = _expand(system.connectors, "", None, shapes, problems)
    for element in system.elements:
        if isinstance(element, SystemElement):
            for connector in element.connectors:
                _remember(connector, element.name, None, shapes, Problems())
            expand_arrays(element, fmus, problems, join(path, element.name))
        elif isinstance(element, DictionaryReference):
            element.connectors = _expand(element.connectors, element.name, None, shapes, problems)
        else:
            fmu = fmus.get(join(path, element.name))
            unusable = {c.name for c in element.connectors if fmu is None and None in [d.size for d in c.dimensions]}
            shapes |= {(element.name, name): None for name in unusable}
            known = [c for c in element.connectors if c.name not in unusable]
            element.connectors = _expand(known, element.name, fmu, shapes, problems)
    system.connections = [c for connection in system.connections for c in _elementwise(connection, shapes, problems)]


def _expand(
    connectors: list[Connector], owner: str, fmu: Fmu | None, shapes: Shapes, problems: Problems
) -> list[Connector]:
    expanded = []
    for connector in connectors:
        _remember(connector, owner, fmu, shapes, problems)
        shape = shapes.get((owner, connector.name)) or ()
        expanded += [
            dataclasses.replace(connector, name=connector.name + index, dimensions=()) for index in indices(shape)
        ]
    return expanded


def _remember(connector: Connector, owner: str, fmu: Fmu | None, shapes: Shapes, problems: Problems) -> None:
    """Find the shape of an array connector."""
    if not connector.dimensions:
        return
    label = f"connector {owner}.{connector.name}" if owner else f"connector {connector.name}"
    sizes = [dimension.size for dimension in connector.dimensions]
    shown = None if fmu is None else fmu.shapes.get((connector.name, len(sizes)))
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


def _elementwise(connection: Connection, shapes: Shapes, problems: Problems) -> list[Connection]:
    start, end = (shapes.get(side, ()) for side in (connection.start, connection.end))
    start, end = (first if first is not None else second or () for first, second in ((start, end), (end, start)))
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
