"""Calls of the kernel subset in C: of kernels, and of the functions that C has too or twip writes in C."""

import ast
import math
from typing import Any

from .expression import UNARY, Code, Expressions
from .value_types import BOOL, C_NAMES, DOUBLE, INTEGER, WHOLE, Named, Type, is_named, type_of_hint

_MATH: dict[Any, tuple[str, int, Type]] = {
    math.sqrt: ("twip_sqrt", 1, DOUBLE),
    math.fabs: ("twip_fabs", 1, DOUBLE),
    math.copysign: ("twip_copysign", 2, DOUBLE),
    math.floor: ("twip_floor", 1, WHOLE),
    math.isfinite: ("twip_isfinite", 1, BOOL),
    math.isnan: ("twip_isnan", 1, BOOL),
    abs: ("twip_fabs", 1, DOUBLE),
}
"""What needs no library: an instruction or a few lines of C (c/twip_number.h)."""
_OWN = tuple(getattr(math, name) for name in ("sin", "cos", "tan", "atan2", "exp", "log"))
"""What every system's library rounds in a way of its own; `twip.robot.elementary` has them as kernels."""


class Calls(Expressions):
    """Translates the expressions of one function, calls among them."""

    def call(self, node: ast.Call) -> Code:
        """Return a call of a kernel, or of one of the functions kernels may call."""
        if node.keywords or any(isinstance(a, ast.Starred) for a in node.args):
            raise self.no(node, f"{ast.unparse(node)}: arguments are given by position")
        called, arguments = self.source.resolve(node.func), node.args
        if called in (max, min) and len(arguments) > 1:
            name = "twip_max" if called is max else "twip_min"
            texts = [self.of_type(a, DOUBLE).text for a in arguments]
            text = texts[0]
            for other in texts[1:]:
                text = f"{name}({text}, {other})"
            return Code(text, DOUBLE)
        if called in (float, int) and len(arguments) == 1:
            return self._converted(self.expression(arguments[0]), called is float, node)
        if called is math.frexp and len(arguments) == 1:
            text = self.of_type(arguments[0], DOUBLE).text
            struct = self.unit.struct((DOUBLE, INTEGER))
            return Code(f"({struct}){{twip_fraction({text}), twip_exponent({text})}}", (DOUBLE, INTEGER))
        if called is math.ldexp and len(arguments) == 2:
            x, twos = self.of_type(arguments[0], DOUBLE), self.of_type(arguments[1], INTEGER)
            return Code(f"twip_ldexp({x.text}, {twos.text})", DOUBLE)
        if called in _OWN:
            name = called.__name__
            rule = f"math.{name} rounds otherwise on every system: from twip.robot.elementary import {name}"
            raise self.no(node, f"{ast.unparse(node)}: {rule}")
        if called in _MATH:
            name, count, kind = _MATH[called]
            if len(arguments) != count:
                raise self.no(node, f"{ast.unparse(node)}: {count} arguments are needed")
            return Code(f"{name}({', '.join(self.of_type(a, DOUBLE).text for a in arguments)})", kind)
        if is_named(called):
            return self._made(node, called)
        return self._kernel_call(node)

    def _made(self, node: ast.Call, called: type) -> Code:
        """Return a NamedTuple made of its fields."""
        kind = type_of_hint(called)
        if not isinstance(kind, Named):
            rule = "the fields of a NamedTuple are float, int, bool or tuples of these"
            raise self.no(node, f"{called.__name__}: {rule}")
        if len(node.args) != len(kind):
            raise self.no(node, f"{ast.unparse(node)}: {called.__name__} takes {len(kind)} arguments")
        texts = [self.of_type(a, part).text for a, part in zip(node.args, kind, strict=True)]
        return Code(f"({self.unit.struct(kind)}){{{', '.join(texts)}}}", kind)

    def _converted(self, code: Code, to_float: bool, node: ast.Call) -> Code:
        if code.type in (DOUBLE, WHOLE):
            return Code(code.text, DOUBLE, code.level) if to_float else Code(f"twip_integer({code.text})", INTEGER)
        if code.type not in (INTEGER, BOOL):
            raise self.no(node, f"{ast.unparse(node)}: only a number can become one of another type")
        kind = DOUBLE if to_float else INTEGER
        return Code(f"({C_NAMES[kind]}){code.at(UNARY)}", kind, UNARY)

    def _kernel_call(self, node: ast.Call) -> Code:
        called = next((f for call, f in self.source.calls if call is node), None)
        if called is None:
            raise self.no(node, f"{ast.unparse(node.func)} is no kernel, and none of the functions kernels may call")
        source = self.unit.add(called)
        if len(node.args) != len(source.arguments):
            raise self.no(node, f"{ast.unparse(node)}: {called.__name__} takes {len(source.arguments)} arguments")
        texts = [self.of_type(a, kind).text for a, kind in zip(node.args, source.arguments.values(), strict=True)]
        return Code(f"{self.unit.name_of(called)}({', '.join(texts)})", source.result)
