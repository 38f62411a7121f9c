"""Shapes of arrays: an element has the array's name and its indices, `x[1]` or `x[2,1]`, counted from 1."""

import itertools
import re
from collections.abc import Iterable

Shape = tuple[int, ...]
"""Sizes by dimension, none for a scalar."""
_ELEMENT = re.compile(r"(.+)\[([1-9][0-9]{0,8}(?:,[1-9][0-9]{0,8})*)\]", re.DOTALL)


def indices(shape: Shape) -> list[str]:
    """Return `[1]`, `[2]` and so on in row-major order, nothing for a scalar."""
    return [f"[{','.join(map(str, i))}]" if shape else "" for i in itertools.product(*(range(1, n + 1) for n in shape))]


def shapes_of(names: Iterable[str]) -> dict[tuple[str, int], Shape]:
    """Return the shapes of the arrays whose elements are among `names`, by name and number of dimensions."""
    found: dict[tuple[str, int], Shape] = {}
    for name in names:
        if name.endswith("]") and (match := _ELEMENT.fullmatch(name)):
            index = tuple(map(int, match[2].split(",")))
            key = match[1], len(index)
            found[key] = tuple(map(max, found.get(key, index), index))
    return found


def shape_text(shape: Shape) -> str:
    """Return a shape as messages show it: `2 x 3`."""
    return " x ".join(map(str, shape)) or "a scalar"
