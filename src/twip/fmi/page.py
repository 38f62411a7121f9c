"""The documentation page that travels in an FMU (documentation/index.html)."""

from html import escape

from markdown_it import MarkdownIt

from .declare import Variable
from .description import Origin
from .interface import Interface
from .table import unit_of

STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #1c2733; max-width: 62rem; margin: 2rem auto; padding: 0 1.2rem; }
h1, h2, h3 { line-height: 1.2; } h2 { margin-top: 2.2rem; border-bottom: 1px solid #d5dde5; padding-bottom: .2rem; }
code, pre { font: 14px/1.45 ui-monospace, monospace; background: #f2f5f8; border-radius: 4px; }
code { padding: .1em .3em; } pre { padding: .8rem 1rem; overflow-x: auto; } pre code { padding: 0; background: none; }
table { border-collapse: collapse; width: 100%; margin: 1rem 0; font-size: 14px; }
th, td { text-align: left; vertical-align: top; padding: .35rem .6rem; border-bottom: 1px solid #e3e9ef; }
th { background: #f2f5f8; } td.number { text-align: right; white-space: nowrap; font-variant-numeric: tabular-nums; }
footer { margin-top: 3rem; color: #5b6b7a; font-size: 13px; }
"""

COLUMNS = {
    "input": ("name", "unit", "start", "min", "max", "meaning"),
    "output": ("name", "unit", "min", "max", "depends directly on", "meaning"),
    "parameter": ("name", "unit", "start", "min", "max", "changes", "meaning"),
    "local": ("name", "unit", "meaning"),
}
HEADINGS = (("input", "Inputs"), ("output", "Outputs"), ("parameter", "Parameters"), ("local", "Internal variables"))


def documentation_page(interface: Interface, version: str, readme: str, guid: str, origin: Origin) -> bytes:
    """Return a self-contained HTML page: the README, then the variables with units, start values, bounds."""
    body = MarkdownIt("commonmark", {"html": False}).enable("table").render(readme)
    if not readme.lstrip().startswith("# "):
        body = f"<h1>{escape(interface.name)}</h1>\n<p>{escape(interface.description)}</p>\n{body}"
    tables = "\n".join(
        _table(title, [v for v in interface.variables if v.causality == causality]) for causality, title in HEADINGS
    )
    facts = " · ".join(
        (
            f"twip {origin.version}",
            origin.tool,
            f"FMI {version} co-simulation",
            f"GUID {guid}",
            origin.copyright,
            origin.license,
        )
    )
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n<title>{escape(interface.name)}</title>\n'
        f"<style>{STYLE}</style>\n</head>\n<body>\n{body}\n{tables}\n<footer>{escape(facts)}</footer>\n</body>\n</html>\n"
    ).encode()


def _table(title: str, variables: list[Variable]) -> str:
    if not variables:
        return ""
    columns = COLUMNS[variables[0].causality]
    head = "".join(f"<th>{c}</th>" for c in columns)
    rows = "\n".join(f"<tr>{_cells(v, columns)}</tr>" for v in variables)
    return f"<h2>{title}</h2>\n<table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{rows}\n</tbody>\n</table>"


def _cells(v: Variable, columns: tuple[str, ...]) -> str:
    number = {"start": v.start, "min": v.minimum, "max": v.maximum}
    text = {
        "name": f"<code>{escape(v.name)}</code>",
        "unit": escape(unit_of(v) or ("" if v.type == "Real" else v.type)),
        "changes": "at any step" if v.variability == "tunable" else "before the start",
        "meaning": escape(v.description),
        "depends directly on": ", ".join(f"<code>{escape(d)}</code>" for d in v.depends) or "nothing",
    }
    numbers = {c: f'<td class="number">{_number(x)}</td>' for c, x in number.items()}
    return "".join(numbers.get(c) or f"<td>{text[c]}</td>" for c in columns)


def _number(value: float | None) -> str:
    if value is None:
        return ""
    return str(value).lower() if isinstance(value, bool) else f"{value:.6g}"
