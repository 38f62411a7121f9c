"""Reads TOML files that others wrote, and knows on which line an entry stands."""

import math
import pathlib
import re
import tomllib

from .files import read_limited
from .problems import Place, Problems
from .xml import MAXIMUM_BYTES

_HEADER = re.compile(r"\s*(\[{1,2})\s*([\w.-]+)\s*\]{1,2}\s*(?:#.*)?")
_KEY = re.compile(r"""\s*(?:"([^"]*)"|'([^']*)'|([\w-]+))\s*=""")


class WrittenNumber(float):
    """A number with a point or an exponent that remembers its text: its digits may be more than a float holds."""

    def __new__(cls, text: str) -> "WrittenNumber":
        """Read a TOML float."""
        number = super().__new__(cls, text.replace("_", ""))
        number._text = text.replace("_", "")
        return number

    _text: str

    def __repr__(self) -> str:
        return self._text

    def __reduce__(self) -> tuple[type["WrittenNumber"], tuple[str]]:
        return WrittenNumber, (self._text,)


class TomlFile:
    """A TOML document and the lines of its tables and keys.

    The parser gives no line numbers; they are sought in the text, and a place lacks its line where the file is written
    in another form than one header per table and one line per key.
    """

    def __init__(self, path: pathlib.Path, problems: Problems):
        """Read `path`; `content` is None when it cannot be read, which is a problem."""
        self.name = path.name
        self.content: dict[str, object] | None = None
        self._lines: dict[tuple[str, int, str], int] = {}
        try:
            data = read_limited(path)
            if len(data) > MAXIMUM_BYTES:
                problems.add(f"{path}: larger than {MAXIMUM_BYTES // 1024 // 1024} MiB, refused")
                return
            text = data.decode("utf-8-sig")
            self.content = tomllib.loads(text.replace("\r\n", "\n"), parse_float=WrittenNumber)
        except (OSError, UnicodeError) as error:
            problems.add(f"{path}: cannot be read ({getattr(error, 'strerror', None) or error})")
        except RecursionError:
            problems.add("not readable as TOML: nested too deeply", Place(self.name))
        except ValueError as error:
            said = str(error).replace("(at end of document)", f"(at line {len(text.splitlines())}, column 1)")
            reason = re.fullmatch(r"(.*) \(at line (\d+), column \d+\)", said, re.DOTALL)
            place = Place(self.name, int(reason[2]) if reason else None)
            problems.add(f"not readable as TOML: {reason[1] if reason else said}", place)
        else:
            self._number_lines(text)

    def _number_lines(self, text: str) -> None:
        table, index, seen = "", 0, dict[str, int]()
        for number, line in enumerate(text.splitlines(), 1):
            if header := _HEADER.fullmatch(line):
                table = header[2]
                index = seen.get(table, 0)
                seen[table] = index + 1
                self._lines.setdefault((table, index, ""), number)
            elif key := _KEY.match(line):
                self._lines.setdefault((table, index, key[1] or key[2] or key[3]), number)

    def place(self, table: str, index: int = 0, key: str = "") -> Place:
        """Where `key` of the `index`-th table called `table` stands, or the table."""
        return Place(self.name, self._lines.get((table, index, key)) or self._lines.get((table, index, "")))


def number(value: object) -> float | None:
    """Return a TOML value as a finite float, None when it is none."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        return float(value) if math.isfinite(value) else None
    except OverflowError:
        return None


def shown(value: object) -> str:
    """Return a TOML value as a message shows it."""
    text = str(value).lower() if isinstance(value, bool) else repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
