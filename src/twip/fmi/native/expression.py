"""Expressions of the kernel subset in C: the text, its type, and how tightly it binds."""

import ast
import math
from typing import TYPE_CHECKING, NamedTuple

from .source import RefusedError, Source
from .value_types import (
    BOOL,
    DOUBLE,
    INTEGER,
    VALUES,
    WHOLE,
    Named,
    Type,
    alike,
    shown,
)

if TYPE_CHECKING:
    from .translate import Unit

PRIMARY, UNARY, PRODUCT, SUM, RELATION, EQUALITY, AND, OR, CHOICE = 9, 8, 7, 6, 5, 4, 3, 2, 1
"""How tightly C's operators bind."""

_BINARY: dict[type[ast.operator], tuple[str, int]] = {
    ast.Add: ("+", SUM), ast.Sub: ("-", SUM), ast.Mult: ("*", PRODUCT), ast.Div: ("/", PRODUCT),
}  # fmt: skip
_COMPARISON: dict[type[ast.cmpop], tuple[str, int]] = {
    ast.Lt: ("<", RELATION), ast.LtE: ("<=", RELATION), ast.Gt: (">", RELATION), ast.GtE: (">=", RELATION),
    ast.Eq: ("==", EQUALITY), ast.NotEq: ("!=", EQUALITY),
}  # fmt: skip
_LARGEST = 2**63 - 1


class Code(NamedTuple):
    """An expression in C."""

    text: str
    type: Type
    level: int = PRIMARY

    def at(self, level: int) -> str:
        """Return the text, in parentheses if it binds less than `level`."""
        return self.text if self.level >= level else f"({self.text})"


def number(value: float) -> str:
    """Return a double in C, exactly."""
    if math.isnan(value):
        return "TWIP_NAN"
    if math.isinf(value):
        return "TWIP_INFINITY" if value > 0.0 else "-TWIP_INFINITY"
    return repr(float(value))


class Expressions:
    """Translates the expressions of one function; what names stand for follows the statements."""

    def __init__(self, unit: "Unit", source: Source):
        self.unit, self.source = unit, source
        self.names: dict[str, Type] = dict(source.arguments)
        """Types of arguments and local names."""
        self.assigned: set[str] = set(source.arguments)
        """Names that have a value wherever the translation is now."""
        self.taken = {unit.name_of(called) for _, called in source.calls}

    def no(self, node: ast.AST, rule: str) -> RefusedError:
        """Return the error for what stands at `node`."""
        return self.source.refuse(node, rule)

    def c_name(self, name: str) -> str:
        """Return the name of an argument or local name in C."""
        return self.unit.c_name(name, self.taken)

    def condition(self, node: ast.expr) -> Code:
        """Return a condition."""
        code = self.expression(node)
        if code.type != BOOL:
            raise self.no(node, f"a condition must be a comparison, not of type {shown(code.type)}")
        return code

    def of_type(self, node: ast.expr, wanted: Type) -> Code:
        """Return an expression of a wanted type."""
        code = self.expression(node, wanted)
        if alike(code.type, wanted):
            return code
        constant = node.value if isinstance(node, ast.Constant) else 0
        if wanted == DOUBLE and code.type == INTEGER and isinstance(constant, int) and constant != 0:
            return Code(number(float(constant)), DOUBLE)
        if wanted == DOUBLE and code.type in (INTEGER, WHOLE):
            raise self.no(node, f"an int where a float is wanted: write float({ast.unparse(node)}), of a constant 0.0")
        if wanted == INTEGER and code.type == WHOLE:
            return Code(f"twip_integer({code.text})", INTEGER)
        if wanted == WHOLE and code.type == INTEGER:
            return code
        raise self.no(node, f"{ast.unparse(node)} is of type {shown(code.type)}, where {shown(wanted)} is wanted")

    def expression(self, node: ast.expr, wanted: Type | None = None) -> Code:
        """Return an expression; `wanted` helps where a type cannot be seen from inside."""
        if isinstance(node, ast.Constant):
            return self._constant(node)
        if isinstance(node, ast.Name | ast.Attribute):
            return self._name(node)
        if isinstance(node, ast.Tuple):
            return self._tuple(node, wanted)
        if isinstance(node, ast.Subscript):
            return self._subscript(node)
        if isinstance(node, ast.UnaryOp):
            return self._unary(node)
        if isinstance(node, ast.BinOp):
            return self._binary(node)
        if isinstance(node, ast.BoolOp):
            sign, level = ("&&", AND) if isinstance(node.op, ast.And) else ("||", OR)
            # compilers warn of && beside || without parentheses
            return Code(f" {sign} ".join(self.condition(v).at(EQUALITY) for v in node.values), BOOL, level)
        if isinstance(node, ast.Compare):
            return self._compare(node)
        if isinstance(node, ast.IfExp):
            return self._choice(node, wanted)
        if isinstance(node, ast.Call):
            return self.call(node)
        raise self.no(node, f"{ast.unparse(node)}: kernels have no expression of this kind ({type(node).__name__})")

    def _constant(self, node: ast.Constant) -> Code:
        value = node.value
        if isinstance(value, bool):
            return Code("true" if value else "false", BOOL)
        if isinstance(value, int) and value <= _LARGEST:
            return Code(f"INT64_C({value})" if value > 2**31 - 1 else str(value), INTEGER)
        if isinstance(value, float):
            return Code(number(value), DOUBLE)
        raise self.no(node, f"{value!r}: kernels have constants of type float, int of 64 bits, and bool only")

    def _name(self, node: ast.Name | ast.Attribute) -> Code:
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            if self.names.get(node.value.id) == VALUES:
                return Code(f"{self.c_name(node.value.id)}->{self.field(node)}", DOUBLE)
            if node.value.id in self.names:
                return self._part(node, self._name(node.value))
        elif isinstance(node, ast.Name) and node.id in self.names:
            if node.id not in self.assigned:
                raise self.no(node, f"{node.id} may not have a value here")
            return Code(self.c_name(node.id), self.names[node.id])
        value = self.source.resolve(node)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.no(node, f"{ast.unparse(node)} is neither a local name nor a number of its module")
        if isinstance(value, int):
            if abs(value) > _LARGEST:
                raise self.no(node, f"{ast.unparse(node)} is beyond 64 bits")
            return Code(self.unit.constant(self.source, ast.unparse(node), value), INTEGER)
        if not math.isfinite(value):
            return Code(number(value), DOUBLE, UNARY if value < 0.0 else PRIMARY)
        return Code(self.unit.constant(self.source, ast.unparse(node), value), DOUBLE)

    def _part(self, node: ast.Attribute, code: Code) -> Code:
        """Return a field of a NamedTuple."""
        names = code.type.names if isinstance(code.type, Named) else ()
        if node.attr not in names:
            raise self.no(node, f"{ast.unparse(node)}: {shown(code.type)} has no field {node.attr}")
        return Code(f"{code.at(PRIMARY)}._{names.index(node.attr)}", code.type[names.index(node.attr)])

    def field(self, node: ast.Attribute) -> str:
        """Return the name of one of the block's values."""
        if node.attr not in self.unit.attributes:
            raise self.no(node, f"{ast.unparse(node)}: the block declares no variable {node.attr}")
        return self.unit.c_name(node.attr)

    def _tuple(self, node: ast.Tuple, wanted: Type | None) -> Code:
        wants: tuple[Type | None, ...] = (None,) * len(node.elts)
        if isinstance(wanted, tuple) and len(wanted) == len(node.elts):
            wants = wanted
        if len(node.elts) < 1 or any(isinstance(e, ast.Starred) for e in node.elts):
            raise self.no(node, "a tuple must have at least one element, and no *")
        parts = [
            self.expression(e) if want is None else self.of_type(e, want)
            for e, want in zip(node.elts, wants, strict=True)
        ]
        kind = tuple(p.type for p in parts)
        return Code(f"({self.unit.struct(kind)}){{{', '.join(p.text for p in parts)}}}", kind)

    def _subscript(self, node: ast.Subscript) -> Code:
        if isinstance(node.value, ast.Name) and node.value.id not in self.names:
            return self._table(node)
        code = self.expression(node.value)
        if isinstance(code.type, str):
            raise self.no(node, f"{ast.unparse(node.value)} is no tuple")
        index = node.slice.value if isinstance(node.slice, ast.Constant) else None
        if not isinstance(index, int) or isinstance(index, bool) or index >= len(code.type):
            raise self.no(node, f"{ast.unparse(node)}: the index must be a constant from 0 to {len(code.type) - 1}")
        return Code(f"{code.at(PRIMARY)}._{index}", code.type[index])

    def _table(self, node: ast.Subscript) -> Code:
        """Return an element of a tuple of numbers that the module defines."""
        values = self.source.resolve(node.value)
        if not isinstance(values, tuple) or not values or not all(type(x) is float for x in values):
            raise self.no(node, f"{ast.unparse(node.value)} is no tuple of floats")
        index = self.of_type(node.slice, INTEGER)
        name = self.unit.table(self.source, ast.unparse(node.value), values)
        return Code(f"{name}[twip_index({index.text}, {len(values)})]", DOUBLE)

    def _unary(self, node: ast.UnaryOp) -> Code:
        if isinstance(node.op, ast.Not):
            return Code(f"!{self.condition(node.operand).at(UNARY)}", BOOL, UNARY)
        code = self.expression(node.operand)
        if code.type not in (DOUBLE, WHOLE, INTEGER) or not isinstance(node.op, ast.USub | ast.UAdd):
            raise self.no(node, f"{ast.unparse(node)}: a sign needs a number")
        if isinstance(node.op, ast.UAdd):
            return code
        if code.type == WHOLE:
            return Code(f"0.0 - {code.at(PRODUCT)}", WHOLE, SUM)  # integers have no -0
        text = code.at(UNARY)
        return Code(f"-({text})" if text.startswith("-") else f"-{text}", code.type, UNARY)

    def _binary(self, node: ast.BinOp) -> Code:
        left, right = self.expression(node.left), self.expression(node.right)
        kinds = {left.type, right.type}
        if not kinds <= {DOUBLE, WHOLE, INTEGER, BOOL}:
            raise self.no(node, f"{ast.unparse(node)}: {shown(left.type)} and {shown(right.type)} cannot be combined")
        if isinstance(node.op, ast.FloorDiv | ast.Mod):
            return self._floor_division(node, left, right)
        if type(node.op) not in _BINARY:
            raise self.no(node, f"{ast.unparse(node)}: kernels have the operators + - * /, and // % of integers")
        sign, level = _BINARY[type(node.op)]
        if sign == "*" and left.type == right.type == WHOLE:
            raise self.no(node, f"{ast.unparse(node)}: a product of two results of floor; make one of them a float")
        kind = DOUBLE if DOUBLE in kinds or sign == "/" else WHOLE if WHOLE in kinds else INTEGER
        first = left.at(level)
        if sign == "/" and not kinds & {DOUBLE, WHOLE}:
            first = f"(double){left.at(UNARY)}"
        return Code(f"{first} {sign} {right.at(level + 1)}", kind, level)

    def _floor_division(self, node: ast.BinOp, left: Code, right: Code) -> Code:
        divisor = node.right.value if isinstance(node.right, ast.Constant) else None
        if left.type != INTEGER or not isinstance(divisor, int) or isinstance(divisor, bool) or divisor < 1:
            raise self.no(node, f"{ast.unparse(node)}: // and % divide an integer by a positive integer constant")
        name = "twip_floor_divide" if isinstance(node.op, ast.FloorDiv) else "twip_floor_remainder"
        return Code(f"{name}({left.text}, {right.text})", INTEGER)

    def _compare(self, node: ast.Compare) -> Code:
        if any(isinstance(n, ast.Call) for middle in node.comparators[:-1] for n in ast.walk(middle)):
            raise self.no(node, f"{ast.unparse(node)}: no call in the middle of a chain")
        parts: list[Code] = []
        for left, operator, right in zip([node.left, *node.comparators], node.ops, node.comparators, strict=False):
            a, b = self.expression(left), self.expression(right)
            if type(operator) not in _COMPARISON:
                raise self.no(node, f"{ast.unparse(node)}: kernels compare by < <= > >= == !=")
            sign, level = _COMPARISON[type(operator)]
            if isinstance(a.type, tuple) and isinstance(b.type, tuple):
                names = all(isinstance(n, ast.Name) for n in (left, right))
                flat = all(isinstance(x, str) for x in a.type)
                if sign != "==" or not names or not flat or not alike(a.type, b.type):
                    rule = "tuples of numbers, by name and of one shape, compare by =="
                    raise self.no(node, f"{ast.unparse(node)}: {rule}")
                parts += [Code(f"{a.text}._{k} == {b.text}._{k}", BOOL, EQUALITY) for k in range(len(a.type))]
            elif not {a.type, b.type} <= {DOUBLE, WHOLE, INTEGER, BOOL}:
                raise self.no(node, f"{ast.unparse(node)}: {shown(a.type)} and {shown(b.type)} do not compare")
            else:
                parts.append(Code(f"{a.at(level + 1)} {sign} {b.at(level + 1)}", BOOL, level))
        return parts[0] if len(parts) == 1 else Code(" && ".join(p.text for p in parts), BOOL, AND)

    def _choice(self, node: ast.IfExp, wanted: Type | None) -> Code:
        test = self.condition(node.test)
        if wanted is None:
            chosen, other = self.expression(node.body), self.expression(node.orelse)
            if not alike(chosen.type, other.type):
                what = f"{shown(chosen.type)} and {shown(other.type)}"
                raise self.no(node, f"{ast.unparse(node)}: both results must be of one type, not {what}")
        else:
            chosen, other = self.of_type(node.body, wanted), self.of_type(node.orelse, wanted)
        return Code(f"{test.at(OR)} ? {chosen.at(OR)} : {other.at(OR)}", chosen.type, CHOICE)

    def call(self, node: ast.Call) -> Code:
        """Return a call; see `Calls`."""
        raise self.no(node, f"{ast.unparse(node)}: no call here")
