"""Finds the members of an open family: each is a class in a file of its own, so that a new file is a new member."""

import pkgutil
from collections.abc import Iterable
from importlib import import_module
from inspect import isabstract


def members(package: str, folders: Iterable[str]) -> list[type]:
    """Return the classes that the modules of a package define, in the order of the modules' names, without abstract
    ones; `folders` are its `__path__`.
    """
    found: list[type] = []
    for name in sorted(f"{package}.{module.name}" for module in pkgutil.iter_modules(folders)):
        defined = vars(import_module(name)).values()
        found += [
            item for item in defined if isinstance(item, type) and item.__module__ == name and not isabstract(item)
        ]
    return found
