"""Packages that only some commands need, and the extra of twip that installs each."""

from importlib import import_module
from typing import Any, NamedTuple

from .errors import TwipError


class Package(NamedTuple):
    """What has to be installed for a module."""

    name: str
    """As package registries know it."""
    extra: str


PACKAGES = {
    "PIL": Package("pillow", "lab"),
    "bokeh": Package("bokeh", "lab"),
    "distributed": Package("distributed", "cluster"),
    "joblib": Package("joblib", "sweep"),
    "matplotlib": Package("matplotlib", "lab"),
    "pyarrow": Package("pyarrow", "sweep"),
    "rerun": Package("rerun-sdk", "view"),
    "scipy": Package("scipy", "lab"),
    "websockets": Package("websockets", "view"),
}
"""By the module's name. Numba (extra `fast`) is not among them: nothing needs it."""
COMMANDS = {"sweep": "sweep", "view": "view"}
"""Extras that install all that a command needs, of commands that need more than `lab`."""


def optional(module: str, user: str) -> Any:
    """Return a module of one of these packages; raises `TwipError`, which names its extra, where it is missing."""
    try:
        return import_module(module)
    except ImportError:
        raise missing(module, user) from None


def missing(module: str, user: str, extra: str | None = None) -> TwipError:
    """Return the error that `user` needs `module`; `extra` installs it where that is not the package's own."""
    package = PACKAGES[module.partition(".")[0]]
    install = f"pip install -e '.[{extra or package.extra}]'"
    return TwipError(f"{user} needs {package.name}, which is not installed: {install}")


def command(name: str, path: str) -> Any:
    """Return the module at `path` of a command; raises `TwipError`, which names the extra of a missing package."""
    try:
        return import_module(path)
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] not in PACKAGES:
            raise
        raise missing(error.name or "", f"twip {name}", COMMANDS.get(name)) from None
