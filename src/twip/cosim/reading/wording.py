"""Numbers of things in words."""


def counted(number: int, noun: str) -> str:
    """Return `1 input`, `2 inputs`; the plural takes an s."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
