"""Statements of the kernel subset in C, and whole functions."""

import ast

from .calls import Calls
from .expression import Code
from .layout import comment, wrapped
from .value_types import BOOL, DOUBLE, INTEGER, NOTHING, VALUES, WHOLE, Type, alike, shown

_IN_PLACE: dict[type[ast.operator], str] = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/"}
_LEAVES = (ast.Return, ast.Break, ast.Continue)


class Function(Calls):
    """Translates one function. `text` is what it is in C."""

    def translate(self) -> str:
        """Return the function in C, below its docstring and where it comes from."""
        self.local: dict[str, Type] = {}
        self._counters: set[str] = set()
        self._temporaries = 0
        body = self.block(self.source.body, 1)
        if self.source.result != NOTHING and not _always_leaves(self.source.body):
            raise self.no(self.source.tree, f"{self.source.tree.name}: not every way through it returns a result")
        unused = [n for n in self.source.arguments if not self._mentioned(n)]
        lines = [f"  {self.unit.c_type(kind)} {', '.join(names)};" for kind, names in self._declared().items()]
        lines += [f"  (void){self.c_name(name)};" for name in unused]
        about = comment(f"{self.source.place}\n{self.source.doc}")
        return "\n".join([about, *wrapped([self.head() + " {"]), *wrapped(lines), *wrapped(body), "}"]) + "\n"

    def head(self) -> str:
        """Return the function's type, name and arguments."""
        constant = "" if self.unit.writes(self.source.function) else "const "
        arguments = [
            f"{constant}{self.unit.values_type} *{self.c_name(name)}"
            if kind == VALUES
            else f"{self.unit.c_type(kind)} {self.c_name(name)}"
            for name, kind in self.source.arguments.items()
        ]
        name = self.unit.name_of(self.source.function)
        return f"static {self.unit.c_type(self.source.result)} {name}({', '.join(arguments) or 'void'})"

    def block(self, body: list[ast.stmt], depth: int) -> list[str]:
        """Return the lines of statements, with the comments before them."""
        lines: list[str] = []
        for statement in body:
            lines += ["  " * depth + line for line in self._remarks(statement)]
            lines += ["  " * depth + line for line in self._statement(statement)]
        return lines

    def _statement(self, s: ast.stmt) -> list[str]:
        match s:
            case ast.Expr(value=ast.Constant()) | ast.Pass():
                return []
            case ast.Expr(value=ast.Call() as call):
                self._in_order(call)
                return [f"{self.expression(call).text};"]
            case ast.Break():
                return ["break;"]
            case ast.Continue():
                return ["continue;"]
            case ast.Return(value=None):
                return ["return;"]
            case ast.Return(value=ast.expr() as value):
                self._in_order(value)
                return [f"return {self.of_type(value, self.source.result).text};"]
            case ast.AnnAssign(target=ast.Name() as target, value=ast.expr() as value):
                return self._assign(target, value)
            case ast.Assign(targets=[target]):
                return self._assign(target, s.value)
            case ast.AugAssign():
                return self._assign_in_place(s)
            case ast.If():
                return self._if(s)
            case ast.For():
                return self._for(s)
            case ast.While(orelse=[]):
                self._in_order(s.test, whole=False)
                before = set(self.assigned)
                lines = [f"while ({self.condition(s.test).text}) {{", *self.block(s.body, 1), "}"]
                self.assigned = before
                return lines
        raise self.no(s, f"kernels have no statement of this kind ({type(s).__name__})")

    def _if(self, s: ast.If) -> list[str]:
        self._in_order(s.test, whole=False)
        lines = [f"if ({self.condition(s.test).text}) {{"]
        before = set(self.assigned)
        lines += self.block(s.body, 1)
        after = before | self.names.keys() if _always_leaves(s.body) else self.assigned
        self.assigned = before
        if s.orelse:
            inner = self.block(s.orelse, 1)
            if len(s.orelse) == 1 and isinstance(s.orelse[0], ast.If) and inner[0].startswith("  if "):
                lines += [f"}} else {inner[0][2:]}", *(line[2:] for line in inner[1:])]
            else:
                lines += ["} else {", *inner, "}"]
        else:
            lines.append("}")
        other = self.assigned | self.names.keys() if _always_leaves(s.orelse) else self.assigned
        self.assigned = after & other
        return lines

    def _for(self, s: ast.For) -> list[str]:
        call = s.iter
        if not (
            isinstance(call, ast.Call) and self.source.resolve(call.func) is range and len(call.args) in (1, 2)
            and not call.keywords and isinstance(s.target, ast.Name) and not s.orelse
        ):  # fmt: skip
            raise self.no(s, "kernels loop by `for name in range(stop)` or `range(start, stop)`")
        for argument in call.args:
            self._in_order(argument, whole=False)
        bounds = [self.of_type(a, INTEGER).text for a in call.args]
        start, stop = ["0", *bounds][-2:]
        self._temporaries += 1
        counter, end, name = f"at{self._temporaries}", f"end{self._temporaries}", s.target.id
        used = name != "_" and any(isinstance(n, ast.Name) and n.id == name for part in s.body for n in ast.walk(part))
        before = set(self.assigned)
        lines = [f"for (int64_t {counter} = {start}, {end} = {stop}; {counter} < {end}; {counter}++) {{"]
        if used:
            if name in self.names:
                raise self.no(s, f"the loop's {name} has another use in this function: give it a name of its own")
            self.names[name] = INTEGER
            self.assigned.add(name)
            self._counters.add(name)
            lines.append(f"  const int64_t {self.c_name(name)} = {counter};")
        lines += [*self.block(s.body, 1), "}"]
        self.assigned = before
        if used:
            del self.names[name]
        return lines

    def _assign_in_place(self, s: ast.AugAssign) -> list[str]:
        self._in_order(s.value, whole=False)
        if not isinstance(s.target, ast.Name | ast.Attribute):
            raise self.no(s, "kernels assign to names and to the block's values")
        read = ast.Name(s.target.id, ast.Load()) if isinstance(s.target, ast.Name) else s.target
        whole = ast.copy_location(ast.BinOp(ast.copy_location(read, s.target), s.op, s.value), s)
        code = self.expression(whole)
        target = self._target(s.target, code)
        if code.type == DOUBLE and type(s.op) in _IN_PLACE:
            return [f"{target} {_IN_PLACE[type(s.op)]}= {self.expression(s.value).text};"]
        return [f"{target} = {code.text};"]

    def _assign(self, target: ast.expr, value: ast.expr) -> list[str]:
        if not isinstance(target, ast.Tuple):
            self._in_order(value)
            code = self._fitting(target, value)
            return [f"{self._target(target, code)} = {code.text};"]
        if not isinstance(value, ast.Tuple):
            self._in_order(value)
            return self._unpack(target, value)
        if len(value.elts) != len(target.elts):
            raise self.no(target, f"{len(value.elts)} values cannot be assigned to {len(target.elts)} names")
        self._in_order(value, whole=False)
        codes = [self._fitting(t, v) for t, v in zip(target.elts, value.elts, strict=True)]
        lines = []
        if _entangled(target, value):
            for i, code in enumerate(codes):
                lines.append(f"const {self.unit.c_type(code.type)} {self._temporary()} = {code.text};")
                codes[i] = Code(f"t{self._temporaries}", code.type)
        return lines + [f"{self._target(t, c)} = {c.text};" for t, c in zip(target.elts, codes, strict=True)]

    def _unpack(self, target: ast.Tuple, value: ast.expr) -> list[str]:
        code = self.expression(value)
        if isinstance(code.type, str) or len(code.type) != len(target.elts):
            raise self.no(target, f"{ast.unparse(value)} cannot be unpacked into {len(target.elts)} names")
        lines, whole = [], code.text
        if not isinstance(value, ast.Name):
            lines.append(f"const {self.unit.struct(code.type)} {self._temporary()} = {code.text};")
            whole = f"t{self._temporaries}"
        for i, part in enumerate(target.elts):
            if not (isinstance(part, ast.Name) and part.id.startswith("_")):  # not needed, by custom
                lines.append(f"{self._target(part, Code('', code.type[i]))} = {whole}._{i};")
        return lines

    def _fitting(self, target: ast.expr, value: ast.expr) -> Code:
        """Return a value as the target's type, where that is known."""
        if isinstance(target, ast.Attribute):
            return self.of_type(value, DOUBLE)
        if isinstance(target, ast.Name) and target.id in self.names:
            return self.of_type(value, self.names[target.id])
        return self.expression(value)

    def _target(self, target: ast.expr, code: Code) -> str:
        """Return what is assigned to; a new name gets the type of what it holds first."""
        if isinstance(target, ast.Attribute) and isinstance(target.value, ast.Name):
            if self.names.get(target.value.id) != VALUES or code.type != DOUBLE:
                raise self.no(target, f"{ast.unparse(target)}: kernels assign floats to the block's values")
            return f"{self.c_name(target.value.id)}->{self.field(target)}"
        if not isinstance(target, ast.Name) or target.id in self._counters:
            raise self.no(target, f"{ast.unparse(target)}: kernels assign to local names and to the block's values")
        if code.type in (NOTHING, VALUES):
            raise self.no(target, f"{target.id}: a name holds numbers or a tuple of them")
        known = self.names.get(target.id)
        if known is None:
            self.names[target.id] = self.local[target.id] = code.type
        elif not alike(known, code.type) and (known, code.type) != (WHOLE, INTEGER):
            raise self.no(target, f"{target.id} was of type {shown(known)} and becomes {shown(code.type)}")
        self.assigned.add(target.id)
        return self.c_name(target.id)

    def _in_order(self, node: ast.expr, whole: bool = True) -> None:
        """Refuse a call that writes the block's values inside a larger expression, whose order C leaves open."""
        for call, called in self.source.calls:
            inside = any(n is call for n in ast.walk(node))
            if inside and not (whole and call is node) and self.unit.writes(called):
                what = f"{called.__name__} writes the block's values"
                raise self.no(call, f"{what}: call it alone, as a statement or as all that is assigned or returned")

    def _temporary(self) -> str:
        self._temporaries += 1
        return f"t{self._temporaries}"

    def _declared(self) -> dict[Type, list[str]]:
        groups: dict[Type, list[str]] = {}
        for name, kind in self.local.items():
            key = DOUBLE if kind == WHOLE else BOOL if kind == BOOL else kind
            groups.setdefault(key, []).append(self.c_name(name))
        return groups

    def _mentioned(self, name: str) -> bool:
        return any(isinstance(n, ast.Name) and n.id == name for s in self.source.body for n in ast.walk(s))

    def _remarks(self, statement: ast.stmt) -> list[str]:
        """Return the comments directly above a statement."""
        above: list[str] = []
        at = statement.lineno - 2
        while at >= 0 and self.source.lines[at].lstrip().startswith("#"):
            above.insert(0, self.source.lines[at].strip().lstrip("# "))
            at -= 1
        return comment("\n".join(above)).splitlines() if above else []


def _always_leaves(body: list[ast.stmt]) -> bool:
    """Return whether the end of statements is never reached."""
    if not body:
        return False
    last = body[-1]
    if isinstance(last, ast.If):
        return _always_leaves(last.body) and _always_leaves(last.orelse)
    return isinstance(last, _LEAVES)


def _entangled(target: ast.Tuple, value: ast.Tuple) -> bool:
    """Return whether a later value reads what an earlier target writes."""
    written = [ast.unparse(t) for t in target.elts]
    for i, later in enumerate(value.elts):
        read = {ast.unparse(n) for n in ast.walk(later) if isinstance(n, ast.Name | ast.Attribute)}
        calls = any(isinstance(n, ast.Call) for n in ast.walk(later))
        if read & set(written[:i]) or (calls and any("." in w for w in written[:i])):
            return True
    return False
