"""The Python code that a block's FMU carries: what it needs, re-rooted under a package named after its content."""

import ast
import hashlib
import sys
from pathlib import Path

from ..errors import TwipError
from .blocks import PACKAGE
from .declare import Block

ROOTS = {"2.0": "fmi/slave_fmi2.py", "3.0": "fmi/slave_fmi3.py"}
"""The module of `twip` that every FMU carries, with all that it imports, by version of FMI."""

FOREIGN = {
    "fmi/slave_fmi2.py": {"pythonfmu"},
    "fmi/slave_fmi3.py": {"pythonfmu3"},
    "robot/kernel.py": {"numba", "numpy"},
}
"""What carried modules may import besides the standard library and each other."""

FACE_MAY_IMPORT = ("twip.robot", "twip.fmi.declare")


def carried_sources(face: Path, version: str) -> dict[str, bytes]:
    """Return path → content of everything a block runs on in FMI `version`, with the face as `face.py`.

    Paths are relative to the FMU's own package. Raises TwipError when a module imports what an FMU does not carry.
    """
    text = face.read_text(encoding="utf-8")
    sources = {"face.py": rerooted(text, face).encode()}
    waiting = [ROOTS[version], *_imported(ast.parse(text), "", face)]
    while waiting:
        path = waiting.pop()
        if path not in sources:
            file = PACKAGE / path
            sources[path] = _without_names(file) if file.name == "__init__.py" else file.read_bytes()
            package = str(Path(path).parent)
            waiting += [f"{package}/__init__.py", *_imported(ast.parse(sources[path]), path, file)]
    return dict(sorted(sources.items()))


def _without_names(package: Path) -> bytes:
    """Return the `__init__.py` of a carried package: its docstring alone, as an FMU carries no caller."""
    docstring = ast.get_docstring(ast.parse(package.read_bytes()))
    return f'"""{docstring}"""\n'.encode()


def rerooted(text: str, face: Path) -> str:
    """Return the source of a face with every `from twip.x import y` as `from .x import y`, and nothing else changed."""
    tree = ast.parse(text, str(face))
    lines = text.splitlines(keepends=True)
    for node in ast.walk(tree):
        if not isinstance(node, ast.ImportFrom | ast.Import):
            continue
        where = f"{face}, line {node.lineno}"
        names = [a.name for a in node.names] if isinstance(node, ast.Import) else [node.module or ""]
        if isinstance(node, ast.ImportFrom) and node.level == 0 and names[0].split(".")[0] == "twip":
            line = lines[node.lineno - 1]
            begin = line[node.col_offset :]
            if not any(names[0] == m or names[0].startswith(m + ".") for m in FACE_MAY_IMPORT):
                raise TwipError(f"{where}: a block may import {' and '.join(FACE_MAY_IMPORT)}, not {names[0]}")
            if not begin.startswith("from twip."):
                raise TwipError(f"{where}: write this import as `from twip.x import y`")
            lines[node.lineno - 1] = line[: node.col_offset] + "from ." + begin.removeprefix("from twip.")
            node.module, node.level = names[0].removeprefix("twip."), 1
        elif isinstance(node, ast.ImportFrom) and node.level:
            raise TwipError(f"{where}: a block imports by absolute names")
        elif any(n.split(".")[0] not in sys.stdlib_module_names for n in names):
            raise TwipError(f"{where}: a block may import the standard library and twip.robot, not {', '.join(names)}")
    changed = "".join(lines)
    if ast.dump(ast.parse(changed)) != ast.dump(tree):
        raise TwipError(f"{face}: write each `from twip.x import y` on a line of its own")
    return changed


def _imported(tree: ast.Module, path: str, file: Path) -> list[str]:
    """Return the modules of `twip` that a module imports, as paths below it; refuse what an FMU does not carry."""
    found: list[str] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.level or (node.module or "").startswith("twip.")):
            if node.level:
                base = Path(path).parts[: -node.level]
                parts = [*base, *(node.module or "").split(".")] if node.module else [*base]
            else:
                parts = (node.module or "").split(".")[1:]
            found += _files(parts, [a.name for a in node.names], file, node.lineno)
        elif isinstance(node, ast.ImportFrom | ast.Import):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else [node.module or ""]
            allowed = sys.stdlib_module_names | FOREIGN.get(path, set())
            wrong = [n for n in names if n.split(".")[0] not in allowed]
            if wrong:
                raise TwipError(f"{file}, line {node.lineno}: an FMU does not carry {', '.join(wrong)}")
    return found


def _files(parts: list[str], names: list[str], file: Path, line: int) -> list[str]:
    """Return the files behind `from parts import names`: the module itself, or modules of a package."""
    module = "/".join(parts)
    if (PACKAGE / f"{module}.py").is_file():
        return [f"{module}.py"]
    if (PACKAGE / module / "__init__.py").is_file():
        inside = [f"{module}/{n}.py" for n in names if (PACKAGE / module / f"{n}.py").is_file()]
        return [f"{module}/__init__.py", *inside]
    raise TwipError(f"{file}, line {line}: there is no module {'.'.join(['twip', *parts])}")


def fingerprint(sources: dict[str, bytes], description: bytes) -> str:
    """Return the SHA-256 of an FMU's code and of its model description without GUID, as 64 hexadecimal digits."""
    digest = hashlib.sha256()
    for name, content in sorted({**sources, "modelDescription.xml": description}.items()):
        digest.update(f"{name}\0{len(content)}\0".encode() + content)
    return digest.hexdigest()


def guid(digest: str) -> str:
    """Return the fingerprint as an FMI GUID."""
    return f"{{{digest[:8]}-{digest[8:12]}-{digest[12:16]}-{digest[16:20]}-{digest[20:32]}}}"


def slave_sources(block: Block, version: str, sources: dict[str, bytes], digest: str) -> tuple[str, dict[str, bytes]]:
    """Return the name of the slave module, and path → content of the FMU's code under names unique to it.

    pythonfmu imports the slave module, runs its text again for every instance and each time drops one reference too
    many to the module's globals. So the module only imports the class, and hands its globals to a list that lasts.
    pythonfmu3 imports the module only, and looks for the text of a class that names `Fmi3Slave` as its base.
    """
    short = digest[:12]
    package, module = f"_twip_{short}", f"twip_slave_{short}"
    name = "".join(part.capitalize() for part in block.name.split("_"))
    base = {"2.0": "BlockSlave2", "3.0": "BlockSlave3"}[version]
    init = f'"""Everything that block {block.name} runs on; the name holds the fingerprint of the content."""\n'
    kept = (
        "KEPT: list[dict[str, object]] = []\n"
        '"""Globals of the slave module, once per instance: pythonfmu drops one reference too many each time."""\n\n\n'
    )
    model = (
        f'"""Block {block.name}, bound to the code it was built from."""\n\n'
        f"from .face import BLOCK\nfrom .fmi.{Path(ROOTS[version]).stem} import {base}\n\n"
        f"{kept if version == '2.0' else ''}"
        f'class {name}({base}):\n    """One instance of block {block.name}."""\n\n'
        f'    block = BLOCK\n    fingerprint = "{short}"\n'
    )
    slave = f'"""Where {"pythonfmu" if version == "2.0" else "pythonfmu3"} enters block {block.name}."""\n\n'
    if version == "2.0":
        slave += f"from {package}.model import KEPT, {name}\n\nKEPT.append(globals())\n"
    else:
        slave += (
            f"from pythonfmu3 import Fmi3Slave\n\nfrom {package}.model import {name} as Model\n\n\n"
            f'class {name}(Model, Fmi3Slave):\n    """One instance of block {block.name}."""\n'
        )
    files = {f"{package}/{path}": content for path, content in sources.items()}
    files |= {f"{package}/__init__.py": init.encode(), f"{package}/model.py": model.encode()}
    return module, {**files, f"{module}.py": slave.encode()}
