"""How a run is to be stepped, as a file proposes it (in the annotation `org.twip.cosim`) or a caller asks for it."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any

from ..reading.problems import Place
from ..reading.xml import ANNOTATION, Element, Reader

COUPLINGS = ("jacobi", "gauss-seidel", "iterated")
_SCHEME = ("coupling", "mid_step", "order", "iteration_tolerance", "maximum_iterations")
"""What belongs to a coupling, and is set aside when the caller names another."""
_LIMITS = ("minimum_step", "maximum_step")
_ATTRIBUTES = {
    "stepSize": "step_size",
    "iterationTolerance": "iteration_tolerance",
    "tolerance": "tolerance",
    "minimumStep": "minimum_step",
    "maximumStep": "maximum_step",
}


@dataclass(frozen=True)
class Algorithm:
    """What somebody says about the steps of a run; None where nothing is said. `Coupling.of` checks it."""

    step_size: float | None = None
    """Communication step in s; the first one if steps are variable."""
    coupling: str | None = None
    mid_step: tuple[str, ...] | None = None
    """Inputs (`component.variable`) that are taken at the middle of a step."""
    order: tuple[str, ...] | None = None
    """All components in the order of execution."""
    own_steps: Mapping[str, float] | None = None
    """Own steps in s, by component."""
    iteration_tolerance: float | None = None
    maximum_iterations: int | None = None
    tolerance: float | None = None
    """Local error per step, relative to magnitude or nominal value; 0 stands for equal steps."""
    minimum_step: float | None = None
    maximum_step: float | None = None
    places: Mapping[tuple[str, str], Place] = field(default_factory=dict, compare=False)
    """Where a file names what: by the field's name, and the name in it (empty for a field without names)."""

    def over(self, proposed: "Algorithm") -> "Algorithm":
        """Return this completed by what is `proposed`; a coupling sets aside what belongs to the proposed one, equal
        steps set aside the limits of variable ones.
        """
        dropped = (_SCHEME if self.coupling is not None else ()) + (_LIMITS if self.tolerance == 0.0 else ())
        taken = {
            f.name: getattr(proposed, f.name)
            for f in fields(self)
            if f.name not in ("places", *dropped) and getattr(self, f.name) is None
        }
        return _with(self, taken)


def read_algorithm(reader: Reader, annotation: Element, before: Algorithm) -> Algorithm:
    """Return what `annotation` adds to what was read `before`; what it says and nobody reads is a problem."""
    found = before
    for item in annotation.iterchildren("{*}*"):
        if _name(item) != "Algorithm":
            reader.problems.add(f"{item.tag} in annotation {ANNOTATION} is not supported", reader.place(item))
            continue
        reader.attributes(item, {"coupling", "maximumIterations", *_ATTRIBUTES})
        places = dict(found.places)
        for attribute, target in _ATTRIBUTES.items():
            if item.get(attribute) is not None:
                found = _with(found, {target: reader.number(item, attribute)})
                places[target, ""] = reader.place(item)
        coupling = item.get("coupling", found.coupling)
        if coupling is not None and coupling not in COUPLINGS:
            reader.problems.add(f"coupling {coupling!r} must be one of {', '.join(COUPLINGS)}", reader.place(item))
            coupling = None
        limit = reader.number(item, "maximumIterations")
        if limit is not None:
            places["maximum_iterations", ""] = reader.place(item)
            if limit != int(limit):
                reader.problems.add(f"maximumIterations = {limit!r} must be a whole number", reader.place(item))
            found = replace(found, maximum_iterations=int(limit))
        found = replace(_read_names(reader, item, found, places), coupling=coupling, places=places)
    return found


def _read_names(reader: Reader, item: Element, found: Algorithm, places: dict[tuple[str, str], Place]) -> Algorithm:
    mid_step, order = list(found.mid_step or ()), list(found.order or ())
    own_steps = dict(found.own_steps or {})
    for child in item.iterchildren("{*}*"):
        kind = _name(child)
        if kind == "MidStep":
            reader.attributes(child, {"input"})
            name = reader.required(child, "input")
            mid_step.append(name)
            places["mid_step", name] = reader.place(child)
        elif kind == "Next":
            reader.attributes(child, {"component"})
            name = reader.required(child, "component")
            order.append(name)
            places["order", name] = reader.place(child)
            places.setdefault(("order", ""), reader.place(child))
        elif kind == "Step":
            reader.attributes(child, {"component", "size"})
            name, size = reader.required(child, "component"), reader.number(child, "size")
            if size is None:
                reader.problems.add(f"the Step of {name} has no size", reader.place(child))
                continue
            if name in own_steps:
                reader.problems.add(f"the Step of {name} is there twice", reader.place(child))
            own_steps[name] = size
            places["own_steps", name] = reader.place(child)
        else:
            reader.problems.add(f"{child.tag} in Algorithm is not supported", reader.place(child))
    return replace(found, mid_step=tuple(mid_step) or None, order=tuple(order) or None, own_steps=own_steps or None)


def _with(algorithm: Algorithm, values: dict[str, Any]) -> Algorithm:
    return replace(algorithm, **values)


def _name(element: Element) -> str:
    return str(element.tag).rpartition("}")[2]
