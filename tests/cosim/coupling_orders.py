"""How far couplings are from closed forms: the second table of docs/coupling.md, and its numbers as Markdown.

Two integrators in a ring, a' = b and b' = -a from a(0) = 0 and b(0) = 1, are sine and cosine over 1 s.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from ssp_writer import bind, component, connection, edit_fmu, linear, system, write

from twip.cosim import Algorithm, Result, Runtime, load, simulate

STEPS = (0.1, 0.05, 0.025)
"""Communication steps in s."""
TOLERANCES = (1e-2, 1e-3, 1e-4)
MID = ("a.u", "b.u")
SCHEMES: dict[str, dict[str, Any]] = {
    "Jacobi": {"coupling": "jacobi"},
    "Jacobi, mid-step": {"coupling": "jacobi", "mid_step": MID},
    "Gauss–Seidel": {"coupling": "gauss-seidel"},
    "Gauss–Seidel, mid-step": {"coupling": "gauss-seidel", "mid_step": MID},
    "iterated": {"coupling": "iterated"},
    "iterated, mid-step": {"coupling": "iterated", "mid_step": MID},
    "Gauss–Seidel, b every 2nd step": {"coupling": "gauss-seidel", "own": 2},
    "Gauss–Seidel, mid-step, b every 2nd step": {"coupling": "gauss-seidel", "mid_step": MID, "own": 2},
}
VARIABLE = ("Jacobi", "Gauss–Seidel, mid-step", "iterated, mid-step")


def ring(fmus: Path, folder: Path) -> Path:
    """Write the ring, with FMUs of `fmus` that can save their state, into `folder`."""
    name = edit_fmu(fmus / "CosimIntegrator.fmu", folder / "integrator.fmu", dependencies={"x": []}, state=True).name
    parts = [
        component("a", name, "u> x<"),
        component("b", name, "u> x<", bind({"x_start": ("Real", 1.0)})),
    ]
    return write(folder, system(parts, [connection("a.x -> b.u", linear(factor=-1)), connection("b.x -> a.u")]))


def run(path: Path, scheme: str, step_size: float, **algorithm: Any) -> tuple[float, Result]:
    """Return the largest error of `a.x` and `b.x`, and the run."""
    chosen = dict(SCHEMES[scheme])
    every = chosen.pop("own", 1)  # between its own steps an output holds
    if every > 1:
        chosen["own_steps"] = {"b": every * step_size}
    with load(path) as loaded:
        result = simulate(
            loaded,
            step_size=step_size,
            algorithm=Algorithm(**chosen, **algorithm),
            runtime=Runtime(loop="python"),
        )
    errors = np.abs(result["a.x"] - np.sin(result.times)), np.abs(result["b.x"] - np.cos(result.times))[::every]
    return float(max(error.max() for error in errors)), result


def markdown(path: Path) -> str:
    """Measure everything, and return the two tables."""
    return "\n".join([*_equal(path), "", *_variable(path)])


def _equal(path: Path) -> Iterator[str]:
    yield f"| equal steps | {' | '.join(f'{h:g} s' for h in STEPS)} | order |"
    yield "|---|" + "---:|" * (len(STEPS) + 1)
    for scheme in SCHEMES:
        errors = [run(path, scheme, step_size=h)[0] for h in STEPS]
        order = np.log2(errors[-2] / errors[-1])
        yield f"| {scheme} | {' | '.join(f'{error:.1e}' for error in errors)} | {order:.1f} |"


def _variable(path: Path) -> Iterator[str]:
    yield f"| variable steps, tolerance | {' | '.join(f'{t:g}' for t in TOLERANCES)} |"
    yield "|---|" + "---:|" * len(TOLERANCES)
    for scheme in VARIABLE:
        runs = [run(path, scheme, step_size=0.01, tolerance=t) for t in TOLERANCES]
        cells = [f"{error:.1e} in {result.steps} steps" for error, result in runs]
        yield f"| {scheme} | {' | '.join(cells)} |"
