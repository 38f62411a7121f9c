"""The frame of every report: one HTML file with its style, its data, BokehJS and our scripts, that fetches nothing."""

import json
from collections.abc import Mapping, Sequence
from html import escape
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any

from bokeh.resources import Resources

from ...outputs import write_file

ENDINGS = (".html", ".htm")


def own(name: str) -> str:
    """Return one of the files beside this module."""
    return (files(__package__) / name).read_text(encoding="utf-8")


def filled(name: str, **parts: str) -> str:
    """Return the template `name` with its parts, which are HTML, filled in."""
    return Template(own(name)).substitute(parts)


def framed(
    kind: str, title: str, verdicts: str, body: str, note: str, data: Mapping[str, Any], scripts: Sequence[str],
    samples: str | None = None,
) -> str:  # fmt: skip
    """Return a page of a `kind` (its class in the style sheet) as HTML.

    `verdicts` and `body` are HTML, `title` and the `note` at the foot are text; `scripts` are names of files beside
    this module, which find `data` (JSON) and `samples` (text) in elements with these ids.
    """
    packed = json.dumps(data, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    elements = [f'<script id="data" type="application/json">{packed}</script>']
    if samples is not None:
        elements.append(f'<script id="samples" type="text/plain">{samples}</script>')
    bokeh = Resources(mode="inline", components=["bokeh", "bokeh-api"], minified=True).js_raw
    return filled(
        "frame.html",
        kind=kind,
        title=escape(title),
        css=own("page.css"),
        verdicts=verdicts,
        body=body,
        footer=escape(f"{note} twip {version('twip')}, drawn with Bokeh {version('bokeh')}."),
        data="\n".join(elements),
        bokeh=_inert("\n".join(bokeh)),
        scripts=_inert("\n".join(own(name) for name in scripts)),
    )


def write_page(text: str, path: Path) -> Path:
    """Write a page to `path`, and return it. Raises TwipError when it cannot be written."""
    write_file(path, text.encode("utf-8", "backslashreplace"))
    return path


def _inert(script: str) -> str:
    """Return a script in which nothing ends the element that holds it."""
    return script.replace("</script", "<\\/script").replace("<!--", "<\\!--")
