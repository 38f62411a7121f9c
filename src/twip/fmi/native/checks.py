"""A block's `check(v)` as C: worked out as far as its constants go, then translated.

Loops over constant tuples are unrolled, `getattr` with a known name becomes the value, and each f-string a row of calls
that write text and numbers. Texts are Python's to the last character: `:g` and `:.Ng` are exact in c/twip_text.h.
"""

import ast
import re
from typing import TYPE_CHECKING, Any

from .expression import Code
from .function import Function
from .layout import comment, text_literal, wrapped
from .source import Signature, Source
from .value_types import INTEGER, VALUES

if TYPE_CHECKING:
    from .translate import Unit

SIGNATURE: Signature = ([VALUES], INTEGER)
_FORMAT = re.compile(r"(?:\.([0-9]+))?g")
_PLAIN_DIGITS = 6
Piece = str | tuple[str, int]
"""A constant text, or a number in C and its significant digits."""


class Check(Function):
    """Translates a `check`, which returns how many sentences it has told."""

    def __init__(self, unit: "Unit", source: Source):
        super().__init__(unit, source)
        self._known: dict[str, Any] = {}
        self._texts: dict[str, list[Piece]] = {}
        self._lists: set[str] = set()

    def head(self) -> str:
        """Return the function's type, name and arguments."""
        argument = next(iter(self.source.arguments))
        name = self.unit.name_of(self.source.function)
        return f"static int {name}(const {self.unit.values_type} *{self.c_name(argument)}, twip_Report *report)"

    def translate(self) -> str:
        """Return the function in C, below its docstring and where it comes from."""
        self.local, self._counters, self._temporaries = {}, set(), 0
        body = self.block(self.source.body, 1)
        lines = [f"  {self.unit.c_type(kind)} {', '.join(names)};" for kind, names in self._declared().items()]
        about = comment(f"{self.source.place}\n{self.source.doc}")
        return "\n".join([about, self.head() + " {", "  int broken = 0;", *wrapped(lines), *wrapped(body), "}"]) + "\n"

    def _statement(self, s: ast.stmt) -> list[str]:
        match s:
            case (
                ast.Assign(targets=[ast.Name(id=name)], value=ast.List(elts=[]))
                | ast.AnnAssign(target=ast.Name(id=name), value=ast.List(elts=[]))
            ):
                self._lists.add(name)
                return []
            case ast.Assign(targets=[ast.Name(id=name)], value=ast.JoinedStr() as text):
                self._texts[name] = self._pieces(text)
                return []
            case ast.Assign(targets=[ast.Tuple(elts=targets)], value=ast.Tuple(elts=values)):
                if len(targets) == len(values):
                    parts = zip(targets, values, strict=True)
                    return [x for t, v in parts for x in self._statement(ast.copy_location(ast.Assign([t], v), s))]
            case ast.Return(value=ast.List(elts=sentences)):
                return [*(line for e in sentences for line in self._told(e)), "return broken;"]
            case ast.Return(value=ast.Name(id=name)) if name in self._lists:
                return ["return broken;"]
            case ast.Return():
                raise self.no(s, "a check returns a list of sentences")
            case ast.Expr(value=ast.Call(func=ast.Attribute(value=ast.Name(id=name), attr="append"), args=[sentence])):
                if name in self._lists:
                    return self._told(sentence)
            case ast.For(orelse=[]):
                return self._unrolled(s)
        return super()._statement(s)

    def _unrolled(self, s: ast.For) -> list[str]:
        items = self._constant_of(s.iter)
        if not isinstance(items, tuple):
            raise self.no(s, "a check loops over tuples of constants")
        lines = []
        for item in items:
            names = s.target.elts if isinstance(s.target, ast.Tuple) else [s.target]
            parts = item if isinstance(s.target, ast.Tuple) else (item,)
            if not isinstance(parts, tuple) or len(parts) != len(names):
                raise self.no(s, f"{item!r} does not fit {ast.unparse(s.target)}")
            self._known |= {ast.unparse(n): part for n, part in zip(names, parts, strict=True)}
            lines += self.block(s.body, 0)
        return lines

    def _constant_of(self, node: ast.expr) -> Any:
        """Return the constant behind an expression, None if there is none."""
        match node:
            case ast.Constant():
                return node.value
            case ast.Name() if node.id in self._known:
                return self._known[node.id]
            case ast.Name() if node.id not in self.names:
                value = self.source.resolve(node)
                return value if isinstance(value, tuple | str) else None
            case ast.Tuple():
                parts = tuple(self._constant_of(e) for e in node.elts)
                return None if None in parts else parts
            case ast.JoinedStr():
                texts = [self._constant_of(p.value if isinstance(p, ast.FormattedValue) else p) for p in node.values]
                return "".join(texts) if all(isinstance(t, str) for t in texts) else None
        return None

    def _pieces(self, node: ast.expr) -> list[Piece]:
        if isinstance(node, ast.Name) and node.id in self._texts:
            return self._texts[node.id]
        constant = self._constant_of(node)
        if isinstance(constant, str):
            return [constant]
        if not isinstance(node, ast.JoinedStr):
            raise self.no(node, f"{ast.unparse(node)}: a sentence is a constant text or an f-string")
        pieces: list[Piece] = []
        for part in node.values:
            if not isinstance(part, ast.FormattedValue):
                pieces += self._pieces(part)
            elif part.format_spec is None:
                pieces += self._pieces(part.value)
            else:
                shape = _FORMAT.fullmatch("".join(str(self._constant_of(p)) for p in _parts(part.format_spec)))
                if shape is None or shape[1] == "0":
                    raise self.no(node, f"{ast.unparse(node)}: numbers are written by :g or :.Ng")
                code = self.expression(part.value)
                if not isinstance(code.type, str) or code.type == VALUES:
                    raise self.no(node, f"{ast.unparse(part.value)} is no number")
                pieces.append((code.text, int(shape[1] or _PLAIN_DIGITS)))
        return pieces

    def _told(self, sentence: ast.expr) -> list[str]:
        lines = ["broken++;", "twip_begin(report);"]
        for piece in self._pieces(sentence):
            if isinstance(piece, str):
                lines.append(f"twip_say(report, {text_literal(piece)});")
            else:
                lines.append(f"twip_say_number(report, {piece[0]}, {piece[1]});")
        return [*lines, "twip_end(report);"]

    def expression(self, node: ast.expr, wanted: Any = None) -> Code:
        """Return an expression; `getattr` with a name known here is a value of the block."""
        if isinstance(node, ast.Call) and self.source.resolve(node.func) is getattr and len(node.args) == 2:
            name = self._constant_of(node.args[1])
            if not isinstance(name, str):
                raise self.no(node, f"{ast.unparse(node)}: the name must be known when the block is built")
            return super().expression(ast.copy_location(ast.Attribute(node.args[0], name, ast.Load()), node))
        if isinstance(node, ast.Name) and isinstance(self._known.get(node.id), int | float):
            return super().expression(ast.copy_location(ast.Constant(self._known[node.id]), node))
        return super().expression(node, wanted)


def _parts(node: ast.expr) -> list[ast.expr]:
    return node.values if isinstance(node, ast.JoinedStr) else [node]
