"""Reads what a file proposes for the steps of a run, from the annotation `org.twip.cosim`."""

from dataclasses import replace

from ..coupling.algorithm_problems import unknown_coupling
from ..coupling.algorithms import COUPLINGS, OPTIONS
from ..model.algorithm import Algorithm
from ..reading.problems import Place
from ..reading.xml import ANNOTATION, Element, Reader

_ATTRIBUTES = {
    "tolerance": "tolerance",
    "minimumStep": "minimum_step",
    "maximumStep": "maximum_step",
}


def read_algorithm(reader: Reader, annotation: Element, before: Algorithm) -> Algorithm:
    """Return what `annotation` adds to what was read `before`; what it says and nobody reads is a problem."""
    found = before
    for item in annotation.iterchildren("{*}*"):
        if _name(item) != "Algorithm":
            reader.problems.add(f"{item.tag} in annotation {ANNOTATION} is not supported", reader.place(item))
            continue
        reader.attributes(item, {"stepSize", "coupling", *(o.attribute for o in OPTIONS.values()), *_ATTRIBUTES})
        places = dict(found.places)
        for attribute, target in _ATTRIBUTES.items():
            if item.get(attribute) is not None:
                found = found.having({target: reader.number(item, attribute)})
                places[target, ""] = reader.place(item)
        coupling = item.get("coupling", found.coupling)
        if coupling is not None and coupling not in COUPLINGS:
            reader.problems.add(unknown_coupling(coupling), reader.place(item))
            coupling = None
        found = replace(found, options={**found.options, **_read_options(reader, item, places)})
        found = replace(_read_names(reader, item, found, places), coupling=coupling, places=places)
    return found


def _read_options(reader: Reader, item: Element, places: dict[tuple[str, str], Place]) -> dict[str, float]:
    found: dict[str, float] = {}
    for option in OPTIONS.values():
        if item.get(option.attribute) is not None:
            places[option.name, ""] = reader.place(item)
        value = reader.number(item, option.attribute)
        if value is not None:
            found[option.name] = option.kind(value)
            if found[option.name] != value:
                reader.problems.add(
                    f"{option.attribute} = {value!r}", reader.place(item), rule="must be a whole number"
                )
    return found


def read_step_size(reader: Reader, annotation: Element, before: float | None) -> float | None:
    """Return the communication step in s that `annotation` proposes, else the one that was read `before`."""
    found = before
    for item in annotation.iterchildren("{*}Algorithm"):
        if item.get("stepSize") is not None:
            found = reader.number(item, "stepSize")
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


def _name(element: Element) -> str:
    return str(element.tag).rpartition("}")[2]
