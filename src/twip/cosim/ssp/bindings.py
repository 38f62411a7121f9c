"""Reads parameter bindings, and the parameter sets and mappings that they refer to."""

import pathlib

from ..reading.files import read_file, read_within
from ..reading.problems import Problems
from ..reading.xml import Element, Reader
from .ssm import ParameterMapping, read_parameter_mapping
from .ssv import ParameterSet, read_parameter_set
from .structure import Binding, Document, Outside


def read_bindings(reader: Reader, element: Element, document: Document, of_component: bool = False) -> list[Binding]:
    """Read the `ParameterBindings` of a component or system."""
    bindings: list[Binding] = []
    for item in reader.listed(element, "ParameterBindings", {"ParameterBinding"}):
        reader.attributes(item, {"type", "source", "sourceBase", "prefix"})
        inside = reader.child(item, "ParameterValues")
        values = read_outside(
            reader, item, inside, "parameter binding", "application/x-ssp-parameter-set", "ParameterSet", of_component
        )
        mapping, mapped = None, reader.child(item, "ParameterMapping")
        if mapped is not None:
            reader.attributes(mapped, {"type", "source", "sourceBase"})
            mapping = read_outside(
                reader, mapped, mapped, "parameter mapping", "application/x-ssp-parameter-mapping", "ParameterMapping",
                of_component,
            )  # fmt: skip
        for child in reader.children(item, {"ParameterValues", "ParameterMapping"}):
            if child is inside:
                reader.attributes(child, set())
        bindings.append(Binding(item.get("prefix", ""), values, mapping, document))
    return bindings


def read_outside(
    reader: Reader, element: Element, inside: Element | None, what: str, type_: str, content: str,
    of_component: bool = False,
) -> Outside:  # fmt: skip
    """Read where something stands: by attributes of `element`, or as one element `content` in `inside`."""
    place = reader.place(element)
    kind = element.get("type", type_)
    if kind != type_:
        reader.problems.add(f"{what} of type {kind} is not supported", place)
    base = element.get("sourceBase", "SSD")
    if base not in ("SSD", "component"):
        reader.problems.add(f"sourceBase = {base!r} of {what}", place, rule="must be SSD or component")
    elif base == "component" and not of_component:
        reader.problems.add(f"a {what} with sourceBase component belongs to a component", place)
    inline = [] if inside is None else list(reader.children(inside, {content}))
    source = element.get("source")
    if (source is None) == (len(inline) != 1) or (source is not None and inline):
        reader.problems.add(f"a {what} needs either a source or one inline {content}", place)
    return Outside(inline[0] if len(inline) == 1 else None, source, base == "component", place)


def find(
    outside: Outside, document: Document, component: pathlib.Path | None, problems: Problems
) -> tuple[Element, str] | None:
    """Return the XML of something inline or of its file, and how messages call that file; None for a problem.

    `component` is the FMU or the folder of the description that a source may be relative to.
    """
    if outside.inline is not None:
        return outside.inline, document.location.name
    if outside.source is None:
        return None
    name = document.location.beside(outside.source)
    if outside.in_component:
        if component is None:
            return None
        root = read_within(component, outside.source, name, problems, outside.place)
    else:
        found = document.location.resolve(outside.source, outside.place, problems)
        if found is not None and found[1]:
            problems.add(f"source {outside.source}: a fragment has no meaning here", outside.place)
            return None
        root = None if found is None else read_file(found[0], name, problems, outside.place)
    return None if root is None else (root, name)


def fetch(
    binding: Binding, component: pathlib.Path | None, problems: Problems
) -> tuple[ParameterSet | None, ParameterMapping | None, bool]:
    """Return the parameter set and the mapping of a binding, and whether all of it could be read."""
    values = find(binding.values, binding.document, component, problems)
    parameters = None if values is None else read_parameter_set(*values, problems)
    mapping = None
    if binding.mapping is not None:
        found = find(binding.mapping, binding.document, component, problems)
        mapping = None if found is None else read_parameter_mapping(*found, problems)
    return parameters, mapping, parameters is not None and (binding.mapping is None) == (mapping is None)
