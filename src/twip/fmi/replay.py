"""Makes an FMU (FMI 2.0) that plays recorded signals: they travel in it as a resource."""

import json
import sys
from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import pythonfmu
from lxml import etree

from ..errors import TwipError
from .archive import write_archive
from .blocks import PACKAGE
from .declare import Variable
from .description import model_description
from .interface import Capabilities, Interface, unit_element
from .origin import licence, origin_of
from .package import licences, packed
from .page import documentation_page
from .rules import NAME
from .sources import fingerprint, guid
from .table import unit_of
from .units import UNITS

CARRIED = ("exit_guard.py", "replay_slave.py")
"""Modules that the FMU runs on."""


@dataclass(frozen=True)
class Recording:
    """Signals over time; all of `columns` are as long as `times` (s)."""

    name: str
    description: str
    signals: tuple[Variable, ...]
    times: Sequence[float]
    columns: tuple[Sequence[float], ...]


def write_replay(recording: Recording, output: Path) -> None:
    """Write the FMU; the same recording gives the same bytes. Raises TwipError when there is nothing to play."""
    name = recording.name
    if not NAME.fullmatch(name) or "." in name:
        raise TwipError(f"{name}: the name of an FMU's model must be an identifier")
    if not recording.signals or not recording.times:
        raise TwipError(f"{name}: there is nothing to play")
    times = list(recording.times)
    interface = _interface(recording, times)
    head = {"name": name, "rows": len(times), "linear": [v.variability == "continuous" for v in recording.signals]}
    numbers = array("d", times)
    for column in recording.columns:
        numbers.extend(column)
    if sys.byteorder == "big":
        numbers.byteswap()
    sources = {name: (PACKAGE / "fmi" / name).read_bytes() for name in CARRIED}
    sources |= {"record.json": json.dumps(head).encode(), "record.bin": numbers.tobytes()}
    terms = licence()
    origin = origin_of(terms, "pythonfmu")
    digest = fingerprint(sources, model_description(interface, "2.0", "", origin))
    package, module = f"_twip_{digest[:12]}", f"twip_slave_{digest[:12]}"
    code = {f"{package}/{path}": content for path, content in sources.items()}
    code[f"{package}/__init__.py"] = b'"""What plays the record beside it."""\n'
    code[f"{package}/model.py"] = (
        b'"""The slave, bound to its record."""\n\n'
        b"from pathlib import Path\n\nfrom .replay_slave import Record, ReplaySlave\n\n"
        b"KEPT: list[dict[str, object]] = []\n"
        b'"""Globals of the slave module, once per instance: pythonfmu drops one reference too many each time."""\n\n\n'
        b'class Replay(ReplaySlave):\n    """One instance."""\n\n    record = Record(Path(__file__).parent)\n'
    )
    code[f"{module}.py"] = (
        f'"""Where pythonfmu enters."""\n\nfrom {package}.model import KEPT, Replay\n\nKEPT.append(globals())\n'
    ).encode()
    files = packed(name, pythonfmu.FmuBuilder, module, code)
    files["modelDescription.xml"] = model_description(interface, "2.0", guid(digest), origin)
    files["documentation/index.html"] = documentation_page(interface, "2.0", "", guid(digest), origin)
    files |= {f"documentation/licenses/{name}": content for name, content in licences(terms, "pythonfmu").items()}
    write_archive(output, files, first="modelDescription.xml")


def _interface(recording: Recording, times: list[float]) -> Interface:
    """Return the face: the signals as outputs, the record's duration and usual step as the default experiment."""
    steps = sorted(b - a for a, b in pairwise(times) if b > a)
    step_size = round(steps[len(steps) // 2], 9) if steps else 1e-3
    used = sorted({unit for v in recording.signals if (unit := unit_of(v))})
    units = tuple(unit_element(u) if u in UNITS else etree.Element("Unit", {"name": u}) for u in used)
    return Interface(
        recording.name,
        recording.description,
        recording.signals,
        units,
        step_size,
        max(times[-1], step_size),
        recording.name,
        Capabilities(),
        {"logStatusWarning": "the record has ended"},
    )
