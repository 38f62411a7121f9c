"""Which connectors may be connected, and in which direction a value flows (SSP 2.0 section 5.3.2.1)."""

_SYSTEM, _ELEMENT = True, False
_TO_ELEMENT = {
    "structuralParameter": ("structuralParameter", "parameter", "input", "inout"),
    "parameter": ("parameter", "input", "inout"),
    "input": ("input", "inout"),
}
_TO_SYSTEM = {
    "structuralParameter": ("calculatedParameter", "output", "local"),
    "parameter": ("calculatedParameter", "output", "local"),
    "input": ("output", "local"),
}
_FROM_ELEMENT = {
    "constant": ("structuralParameter", "parameter", "input", "inout"),
    "calculatedParameter": ("parameter", "input", "inout"),
    "output": ("input", "inout"),
    "local": ("input", "inout"),
    "inout": ("input",),
}
_UP = {
    "constant": ("constant", "calculatedParameter", "output", "local"),
    "calculatedParameter": ("calculatedParameter", "output", "local"),
    "output": ("output", "local"),
    "local": ("output", "local"),
    "inout": ("output", "local"),
}
End = tuple[bool, str]
"""Whether a connector belongs to the system that holds the connection (else to an element in it), and its kind."""

ALLOWED: frozenset[tuple[End, End]] = frozenset(
    ((source, kind), (target, other))
    for source, target, table in (
        (_SYSTEM, _ELEMENT, _TO_ELEMENT),
        (_SYSTEM, _SYSTEM, _TO_SYSTEM),
        (_ELEMENT, _ELEMENT, _FROM_ELEMENT),
        (_ELEMENT, _SYSTEM, _UP),
    )
    for kind, others in table.items()
    for other in others
)
"""Source and target of every allowed connection."""
GIVING = ("input", "parameter", "structuralParameter")
"""Kinds of system connectors through which values come into the system."""
PARAMETERS = ("parameter", "structuralParameter")
"""Kinds of connectors whose value is that of the whole run."""


def gives(end: End) -> bool:
    """Tell whether a connector gives a value to connections of the system that holds them."""
    return (end[1] in GIVING) == end[0]


def refusal(a: End, b: End) -> str:
    """Return why two connectors cannot be connected in any direction, or nothing."""
    if (a, b) in ALLOWED or (b, a) in ALLOWED:
        return ""
    if "inout" not in (a[1], b[1]) and gives(a) == gives(b):
        return f"both ends {'give' if gives(a) else 'take'} a value ({a[1]} to {b[1]})"
    source, target = (a, b) if gives(a) or b[1] == "inout" else (b, a)
    return f"{source[1]} cannot feed {target[1]}"
