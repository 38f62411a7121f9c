"""Texts as numbers: a String variable travels in the vector of values as the number of its text.

Each text that occurs gets a number once, for as long as the process lives. The numbers mean nothing outside: logs,
tables and checkpoints hold the texts.
"""

_texts = [""]
_numbers = {"": 0.0}


def number_of(text: str) -> float:
    """Return the number of a text; that of the empty one is 0."""
    number = _numbers.get(text)
    if number is None:
        number = _numbers[text] = float(len(_texts))
        _texts.append(text)
    return number


def text_of(number: float) -> str:
    """Return the text with a number."""
    return _texts[int(number)]
