"""The table that an identification prints."""

from collections.abc import Mapping

from ...robot import value
from .estimate import Estimate
from .identify import Identification
from .inertia import estimated_inertia

HEAD = ("parameter", "value", "95 % interval", "unit", "identifiable")


def row(name: str, estimate: Estimate) -> tuple[str, str, str, str, str]:
    """Return the cells of one parameter."""
    if estimate.value is None or estimate.low is None or estimate.high is None:
        return name, "-", "-", estimate.unit, f"no: {estimate.reason}"
    half = 50.0 * (estimate.high - estimate.low) / abs(estimate.value)
    interval = f"{estimate.low:.4e} … {estimate.high:.4e} (±{half:.2g} %)"
    return name, f"{estimate.value:.4e}", interval, estimate.unit, "yes"


def table(side: str, found: Identification, truth: Mapping[str, float] | None = None) -> str:
    """Return the table of one side's parameters; with the `truth` of a simulated motor, by parameter, beside them."""
    rows = [list(row(f"{side}.{e.name}", e)) for e in found.estimates]
    head = list(HEAD)
    if truth is not None:
        head.insert(4, "truth")
        for cells, estimate in zip(rows, found.estimates, strict=True):
            true = truth.get(estimate.name)
            cells.insert(4, "-" if true is None else f"{true:.4e}")
    widths = [max(len(cells[i]) for cells in [head, *rows]) for i in range(len(head) - 1)]
    lines = [
        "  ".join([*(cell.ljust(width) for cell, width in zip(cells, widths, strict=False)), cells[-1]])
        for cells in [head, *rows]
    ]
    return "\n".join(lines)


def notes(found: Identification) -> list[str]:
    """Return what the reader of the table must know beside it."""
    lines = [
        f"{len(found.samples)} steady samples, {len(found.runs)} run-ups; all torques rest on K_t ="
        f" {found.torque_constant:g} N.m/A, whose error no interval contains"
    ]
    if found.samples.known_errors and not found.samples.offset_error.any():
        lines.append("the zero of the current is taken as exact: record the motor switched off first, and give --zero")
    inertia = found.inertia
    if inertia.value is not None and inertia.low is not None and inertia.high is not None:
        disc = estimated_inertia(*(value(name) for name in (
            "wheel_mass", "wheel_radius", "gear_ratio", "rotor_inertia", "gear_inertia",
        )))  # fmt: skip
        off = 100.0 * (inertia.value / disc - 1.0)
        within = "within" if inertia.covers(disc) else "outside"
        lines.append(
            f"eq (12) estimates {disc:.4e} kg.m2 for wheels that are uniform discs: the identified inertia is"
            f" {off:+.1f} % from it, {within} the interval"
        )
    return lines
