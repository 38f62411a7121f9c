"""A Python function as the translator reads it: its tree, where it stands, its types, what it calls and writes."""

import ast
import builtins
import inspect
import textwrap
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any, get_type_hints

from ...errors import TwipError
from ...robot.kernel import is_kernel
from .value_types import DOUBLE, NOTHING, VALUES, Type, type_of_hint

Signature = tuple[list[Type], Type]
"""Types of arguments, and of the result."""


class RefusedError(TwipError):
    """A function goes beyond the kernel subset; the message has file, line and rule."""


class Source:
    """One function of a block or of `twip.robot`."""

    def __init__(self, function: Callable[..., Any], signature: Signature | None = None):
        self.function = function
        self._globals: dict[str, Any] = inspect.unwrap(function).__globals__
        self.file = inspect.getsourcefile(function) or "?"
        try:
            lines, self.first = inspect.getsourcelines(function)
        except OSError:
            raise RefusedError(f"{self.file}: the source of {function.__name__} cannot be read") from None
        self.lines = textwrap.dedent("".join(lines)).splitlines()
        tree = ast.parse("\n".join(self.lines)).body[0]
        if not isinstance(tree, ast.FunctionDef):
            raise RefusedError(f"{self.file}, line {self.first}: a kernel is a function made by def")
        self.tree = tree
        self.doc = ast.get_docstring(tree) or ""
        self.body = tree.body[1:] if self.doc else tree.body
        self.arguments, self.result = self._signature(signature)

    @property
    def module(self) -> str:
        """Return the last part of the module's name: `stiction`; for a face the block's name."""
        return str(self.function.__module__).rpartition(".")[2].removeprefix("twip_face_")

    @property
    def place(self) -> str:
        """Return where the function is, as comments in C name it: `robot/stiction.py:45`."""
        return f"{'/'.join(Path(self.file).parts[-2:])}:{self.first}"

    def refuse(self, node: ast.AST, rule: str) -> RefusedError:
        """Return the error for what stands at `node`."""
        return RefusedError(f"{self.file}, line {self.first + getattr(node, 'lineno', 1) - 1}: {rule}")

    def resolve(self, node: ast.expr) -> Any:
        """Return the object that a name, or a name of a module (`math.pi`), stands for outside the function; None if
        there is none.
        """
        if isinstance(node, ast.Name):
            return self._globals.get(node.id, getattr(builtins, node.id, None))
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            module = self._globals.get(node.value.id)
            return getattr(module, node.attr, None) if isinstance(module, ModuleType) else None
        return None

    @cached_property
    def calls(self) -> list[tuple[ast.Call, FunctionType]]:
        """Return the calls of kernels."""
        found = []
        for node in ast.walk(self.tree):
            called = self.resolve(node.func) if isinstance(node, ast.Call) else None
            if isinstance(node, ast.Call) and isinstance(called, FunctionType) and is_kernel(called):
                found.append((node, called))
        return found

    @cached_property
    def stores(self) -> bool:
        """Return whether the function itself writes values of the block."""
        return any(isinstance(n, ast.Attribute) and isinstance(n.ctx, ast.Store) for n in ast.walk(self.tree))

    def _signature(self, given: Signature | None) -> tuple[dict[str, Type], Type]:
        a = self.tree.args
        if a.posonlyargs or a.kwonlyargs or a.vararg or a.kwarg or a.defaults:
            raise self.refuse(self.tree, f"{self.tree.name}: a kernel has plain arguments, without defaults")
        if given is not None:
            if len(given[0]) != len(a.args):
                raise self.refuse(self.tree, f"{self.tree.name} must take {len(given[0])} arguments")
            return dict(zip((x.arg for x in a.args), given[0], strict=True)), given[1]
        hints = get_type_hints(self.function)
        arguments: dict[str, Type] = {}
        for argument in (*(x.arg for x in a.args), "return"):
            kind = type_of_hint(hints[argument]) if argument in hints else None
            if kind is None or (kind == NOTHING and argument != "return") or (kind == VALUES and argument == "return"):
                what = "the result" if argument == "return" else argument
                raise self.refuse(
                    self.tree,
                    f"{self.tree.name}: {what} must be annotated as float, int, bool or tuple of these, "
                    "the block's values as Any, no result as None",
                )
            arguments[argument] = kind
        result = arguments.pop("return")
        return arguments, result


INITIALIZE: Signature = ([VALUES, DOUBLE], NOTHING)
STEP: Signature = ([VALUES, DOUBLE, DOUBLE], NOTHING)
"""What a block's `initialize(v, time)` and `step(v, time, step_size)` take, annotated or not."""
