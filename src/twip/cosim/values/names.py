"""Names of what a system holds: a component's variables and the connectors of systems."""

Key = tuple[str, str]
"""Dotted path of a component or system (empty for the outermost system), and the name of a connector or variable."""


def full_name(key: Key) -> str:
    """Return `component.variable`, or the bare name of a connector of the outermost system."""
    return f"{key[0]}.{key[1]}" if key[0] else key[1]
