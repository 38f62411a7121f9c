"""How generated C is laid out: comments, and lines that fit the page."""

import textwrap
from collections.abc import Iterable

WIDTH = 120


def comment(text: str) -> str:
    """Return text as a C comment."""
    lines = text.rstrip().replace("*/", "* /").replace("/*", "/ *").splitlines()
    return "/* " + "\n".join(f"   {line}".rstrip() for line in lines).lstrip() + " */" if lines else ""


def wrapped(lines: Iterable[str]) -> list[str]:
    """Return lines broken at spaces where they are too long; texts in quotes stay whole."""
    result: list[str] = []
    for line in lines:
        if len(line) <= WIDTH or '"' in line or line.lstrip().startswith(("/*", "   ")):
            result.append(line)
            continue
        indent = line[: len(line) - len(line.lstrip())]
        result += textwrap.wrap(
            line, WIDTH, subsequent_indent=indent + "    ", break_long_words=False, break_on_hyphens=False
        )
    return result


def text_literal(text: str) -> str:
    """Return text as a C literal in UTF-8."""
    shown = (chr(b) if 0x20 <= b < 0x7F else f"\\{b:03o}" for b in text.encode())
    return '"' + "".join("\\" + c if c in ('"', "\\", "?") else c for c in shown) + '"'
