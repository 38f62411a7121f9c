"""The report of a sweep: what varied, how often it passed, maps, ranking, metrics and failed runs in one HTML file."""

import itertools
from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import TwipError
from ..sweep.classes import Classes, cell_means, groups
from ..sweep.parquet import NOT_NUMBERS, Results
from ..sweep.pictures import BETWEEN, FAILS, PASSES
from ..sweep.statistics import CONFIDENCE, Array, Rate, rank_regression, sobol_indices
from .about import table
from .frame import filled, framed, write_page

MOST_MAPS = 6
MOST_ERRORS = 100
"""Failed runs that are listed."""
_PASSES = (FAILS, BETWEEN, PASSES)
_NUMBERS = ("#440154", "#3b528b", "#21918c", "#5ec962", "#fde725")
"""Colours from the smallest to the largest value: viridis."""
_TOLD = 6
"""Metrics that a cell of a map tells."""


def sweep_report(source: Path, path: Path) -> Path:
    """Write the report of a sweep's Parquet file `source` to `path`, and return it.

    Raises `TwipError` when `source` is no such file, holds no runs, or the report cannot be written.
    """
    results = Results.read(source)
    if not results.columns["run"]:
        raise TwipError(f"{source} has no runs to show")
    try:
        text = sweep_page(results, source.stem)
    except (AttributeError, IndexError, KeyError, TypeError, ValueError):  # its description is another one's
        raise TwipError(f"{source} is not the Parquet file of a sweep") from None
    return write_page(text, path)


def sweep_page(results: Results, title: str) -> str:
    """Return the report as HTML."""
    rankings, unranked = _rankings(results)
    note = f"{CONFIDENCE:.0%} intervals: Wilson's of shares, bootstrap of rankings. A run that failed has not passed."
    verdicts = f'<span class="verdict" style="--mark: var(--blue)">{escape(_counts(results))}</span>'
    if missing := results.runs - len(results.columns["run"]):
        runs = "1 run is" if missing == 1 else f"{missing} runs are"
        verdicts += f'<span class="remark">{runs} missing: the sweep was interrupted</span>'
    body = filled(
        "sweep.html",
        before=table("What varied", [""], _plan(results)) + _rates(results),
        after=unranked + _metrics(results) + _failed(results) + _origin(results),
    )
    data = {"maps": _maps(results), "rankings": rankings}
    return framed("sweep", title, verdicts, body, note, data, ["sweep.js"])


def _counts(results: Results) -> str:
    verdicts = results.columns["verdict"]
    counts = [f"{verdicts.count(v)} {v}" for v in dict.fromkeys(map(str, verdicts))]
    return f"{len(verdicts)} of {results.runs} runs: {', '.join(counts)}"


def _plan(results: Results) -> dict[str, list[str | None]]:
    told = results.description
    rows: dict[str, list[str | None]] = {"system": [str(told.get("system", ""))]}
    for axis in told["axes"]:
        values = axis["distribution"] or ", ".join(_text(v) for v in axis.get("values", ()))
        names = ", ".join(map(str, axis.get("names", ())))
        also = f" ({names})" if names != axis["label"] else ""
        rows[results.titled(str(axis["label"]))] = [f"{values}{also}"]
    if "parameters" in results.columns:
        rows["parameter sets"] = [", ".join(map(str, dict.fromkeys(results.columns["parameters"])))]
    for key in ("design", "samples", "repeat", "seed", "start_time", "stop_time", "step_size", "coupling"):
        if told.get(key) not in (None, 0, ""):
            unit = " s" if key.endswith(("time", "size")) else ""
            rows[key.replace("_", " ")] = [f"{told[key]}{unit}"]
    rows["passes if"] = [
        ", ".join(map(str, told.get("success", ()))) or ("fallen == 0" if results.judged else "no conditions")
    ]
    return rows


def _rates(results: Results) -> str:
    if not results.judged:
        return ""
    rows: dict[str, list[str | None]] = {}
    success = results.numbers("success")
    for label, chosen in groups(results, set()):
        rate = _rate(success[chosen])
        low, high = rate.interval
        rows[label or "all runs"] = [
            f"{rate.successes} of {rate.runs}",
            f"{rate.share:.1%}",
            f"{low:.1%} to {high:.1%}",
        ]
    return table("Success rate", ["pass", "share", f"{CONFIDENCE:.0%} interval"], rows)


def _rate(success: Array) -> Rate:
    return Rate(int(np.sum(success > 0.5)), len(success))


def _metric_names(results: Results) -> list[str]:
    return [name for name in results.columns if name not in (*NOT_NUMBERS, "seed", *results.axes)]


def _maps(results: Results) -> list[dict[str, Any]]:
    """Return the maps over each two axes that were varied on grids, as the script takes them."""
    grids = [str(a["label"]) for a in results.description["axes"] if not a["distribution"] and len(a["values"]) > 1]
    metrics = _metric_names(results)
    if results.judged:
        what = "success"
    else:
        what = next((name for name in metrics if np.any(np.isfinite(results.numbers(name)))), "")
    return [_map(results, x, y, what, metrics) for x, y in list(itertools.combinations(grids, 2))[:MOST_MAPS] if what]


def _map(results: Results, x: str, y: str, what: str, metrics: list[str]) -> dict[str, Any]:
    across, down = Classes(results, x), Classes(results, y)
    values, success = results.numbers(what), results.numbers("success")
    share = what == "success"
    shown = values[np.isfinite(values)]
    low, high = (0.0, 1.0) if share else (float(np.min(shown)), float(np.max(shown)))
    told = [name for name in metrics if np.any(np.isfinite(results.numbers(name)))][:_TOLD]
    panels = []
    for label, chosen in groups(results, {x, y}):
        means = cell_means(values, chosen, across, down)
        cells: dict[str, list[Any]] = {name: [] for name in ("x", "y", "shade", "value", "runs", *_fields(told))}
        for i, j in itertools.product(range(down.count), range(across.count)):
            inside = chosen & (down.index == i) & (across.index == j)
            mean, runs = float(means[i, j]), int(np.sum(inside))
            cells["x"].append(across.texts[j])
            cells["y"].append(down.texts[i])
            cells["shade"].append((mean - low) / ((high - low) or 1.0) if np.isfinite(mean) else None)
            rate = _rate(success[inside])
            first, last = rate.interval
            passed = f"{rate.successes} of {runs} ({first:.0%} to {last:.0%})"
            told_mean = _text(mean) if np.isfinite(mean) else "no finite number"
            cells["value"].append((passed if share else told_mean) if runs else "no runs")
            cells["runs"].append(runs)
            for field, name in zip(_fields(told), told, strict=True):
                cells[field].append(_text(_quantiles(results.numbers(name)[inside])[1]))
        panels.append({"label": label, "cells": cells})
    also = [[f"{results.titled(name)}, median", field] for name, field in zip(told, _fields(told), strict=True)]
    return {
        "title": f"{'Share that passes' if share else results.titled(what)} over {x} and {y}",
        "note": "Point at a cell for its numbers.",
        "colors": _PASSES if share else _NUMBERS,
        "ends": ["none passes", "all pass"] if share else [_text(low), _text(high)],
        "x": across.name,
        "y": down.name,
        "across": list(dict.fromkeys(across.texts)),
        "down": list(dict.fromkeys(down.texts)),
        "told": [[across.name, "x"], [down.name, "y"], ["pass" if share else what, "value"], ["runs", "runs"], *also],
        "panels": panels,
    }


def _fields(told: list[str]) -> list[str]:
    return [f"metric{i}" for i in range(len(told))]


def _rankings(results: Results) -> tuple[list[dict[str, Any]], str]:
    """Return what each parameter set's first metric (or success) depends on, and a table of what cannot be ranked."""
    what = "success" if results.judged else next(iter(_metric_names(results)), "")
    found, failed = [], dict[str, list[str | None]]()
    for label, _ in groups(results, set()) if what else ():
        part = results.only(label) if label else results
        head = f"What {what} depends on{f', {label}' if label else ''}"
        try:
            if results.description["design"] == "indices":
                ranked = sorted(sobol_indices(part, what)[1], key=lambda i: -i.value)
                note = "Total Sobol indices: the share of the variance with all interactions."
            else:
                ranked, explained = rank_regression(part, what)
                note = f"Standardized rank regression coefficients, R² = {explained:.2f}."
        except TwipError as error:
            failed[head] = list(map(str, error.problems))
            continue
        bars: dict[str, list[Any]] = {"axis": [i.axis for i in ranked]}
        for name in ("value", "low", "high"):
            bars[name] = [_finite(getattr(i, name)) for i in ranked]
        found.append({"title": head, "note": note, "bars": bars})
    return found, table("Not ranked", [""], failed)


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _metrics(results: Results) -> str:
    rows: dict[str, list[str | None]] = {}
    for name in _metric_names(results):
        values = results.numbers(name)
        known = int(np.sum(~np.isnan(values)))
        rows[results.titled(name)] = [*(_text(v) for v in _quantiles(values)), str(known)]
    return table("Metrics", ["min", "median", "max", "runs"], rows)


def _quantiles(values: Array) -> tuple[float, float, float]:
    """Return smallest, median (the lower of the two in the middle) and largest value, nan where there is none."""
    known = np.sort(values[~np.isnan(values)])
    if not known.size:
        return np.nan, np.nan, np.nan
    return float(known[0]), float(known[(len(known) - 1) // 2]), float(known[-1])


def _failed(results: Results) -> str:
    columns = results.columns
    rows: dict[str, list[str | None]] = {}
    failed = [i for i, verdict in enumerate(columns["verdict"]) if verdict == "error"]
    for i in failed[:MOST_ERRORS]:
        inputs = ", ".join(f"{name} {_text(columns[name][i])}" for name in results.axes)
        rows[f"run {columns['run'][i]}"] = [inputs, str(columns["error"][i])]
    if len(failed) > MOST_ERRORS:
        rows[f"… and {len(failed) - MOST_ERRORS} more"] = [None, None]
    return table("Runs that failed", ["inputs", "error"], rows)


def _origin(results: Results) -> str:
    rows: dict[str, list[str | None]] = {name: [str(text)] for name, text in results.versions.items()}
    prints: Mapping[str, Any] = results.description.get("files", {})
    rows |= {name: [str(text)[:12]] for name, text in prints.items()}
    for entries in results.description.get("provenance", {}).values():
        for title, values in entries.items():
            if "sha256" in values:
                name = values.get("fmu", values.get("file", ""))
                rows[title] = [f"{name} {values['sha256'][:12]}"]
    return table("Versions and fingerprints", [""], rows)


def _text(value: object) -> str:
    """Return a number as people read it; other values as they are."""
    if isinstance(value, float):
        return "–" if np.isnan(value) else "∞" if value == np.inf else f"{value:.4g}"
    return str(value)
