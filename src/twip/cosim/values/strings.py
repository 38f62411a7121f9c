"""Texts as numbers: a String variable travels in the vector of values as the number of its text.

Each text that occurs gets a number once, for as long as the process lives. The numbers mean nothing outside: logs,
tables and checkpoints hold the texts. The process of an isolated FMU asks the run for the numbers.
"""

from collections.abc import Callable

_texts = {0.0: ""}
_numbers = {"": 0.0}
_asked: list[tuple[Callable[[str], float], Callable[[float], str]]] = []


def passes(text: str) -> bool:
    """Tell whether FMUs can be given a text whole: in C it ends at the first NUL, and it is UTF-8."""
    try:
        return b"\0" not in text.encode()
    except UnicodeEncodeError:
        return False


def number_of(text: str) -> float:
    """Return the number of a text; that of the empty one is 0."""
    number = _numbers.get(text)
    if number is None:
        number = _asked[0][0](text) if _asked else float(len(_texts))
        _numbers[text], _texts[number] = number, text
    return number


def text_of(number: float) -> str:
    """Return the text with a number. Raises `KeyError` for one that no text has."""
    text = _texts.get(number)
    if text is None:
        if not _asked:
            raise KeyError(number)
        text = _asked[0][1](number)
        _numbers[text], _texts[number] = number, text
    return text


def ask(number_of: Callable[[str], float], text_of: Callable[[float], str]) -> None:
    """From now on let others say what is not known here."""
    _asked[:] = [(number_of, text_of)]
