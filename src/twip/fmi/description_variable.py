"""What both versions of FMI write of a variable and of what an output depends on."""

from .declare import Variable
from .interface import Interface
from .table import unit_of


def common_attributes(v: Variable, reference: int) -> dict[str, str]:
    """Return the attributes that do not depend on the type."""
    attributes = {
        "name": v.name,
        "valueReference": str(reference),
        "description": v.description,
        "causality": v.causality,
        "variability": v.variability,
    }
    if v.causality == "parameter":
        attributes["initial"] = "exact"
    elif v.causality != "input":
        attributes["initial"] = "calculated"
    return attributes


def typed_attributes(v: Variable) -> dict[str, str]:
    """Return unit, bounds, nominal and start value, exactly."""
    details = {"unit": unit_of(v), "displayUnit": v.display_unit} if v.type == "Real" else {}
    if v.relative:
        details["relativeQuantity"] = "true"
    numbers = {"min": v.minimum, "max": v.maximum, "nominal": v.nominal, "start": v.start}
    if v.type == "Boolean":
        numbers = {"start": v.start}
    details |= {name: value_text(v.type, x) for name, x in numbers.items() if x is not None}
    return {name: text for name, text in details.items() if text is not None}


def value_text(kind: str, value: float) -> str:
    """Return a number as FMI writes it in a variable of type `kind`, exactly."""
    if kind == "Boolean":
        return "true" if value else "false"
    return str(int(value)) if kind == "Integer" else repr(float(value))


def knowns(interface: Interface) -> dict[str, tuple[list[str], list[str] | None]]:
    """Return for each output what it depends on, by name: in a step, and at initialization (None: on everything)."""
    parameters = [v.name for v in interface.variables if v.causality == "parameter"]
    return {
        v.name: ([*v.depends], None if interface.initially_all else [*v.depends, *parameters, *v.initially])
        for v in interface.variables
        if v.causality == "output"
    }
