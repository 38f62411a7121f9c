"""Builds the FMU that misbehaves on demand, and systems of it."""

import subprocess
import zipfile
from pathlib import Path

from ssp_writer import component, connection, system, write

SOURCES = Path(__file__).parent / "c"
WHERE = {
    name: i
    for i, name in enumerate(
        ("setup", "enter", "exit", "set", "step", "get", "terminate", "free", "reset", "save", "restore"), 1
    )
}
WHAT = (
    {"warning": 1, "discard": 2, "error": 3, "fatal": 4, "pending": 5}
    | {
        name: i
        for i, name in enumerate(("crash", "quit", "loop", "abort", "print", "talk", "leak", "strange", "end"), 10)
    }
    | {name: i for i, name in enumerate(("leave", "vanish", "close", "fork", "mute", "remove"), 19)}
)


def build(folder: Path) -> Path:
    """Compile `faulty.fmu` in `folder`."""
    library = folder / "faulty.so"
    subprocess.run(
        ["cc", "-shared", "-fPIC", "-O1", "-o", library, SOURCES / "faulty.c"], check=True, capture_output=True
    )
    with zipfile.ZipFile(folder / "faulty.fmu", "w") as archive:
        archive.write(SOURCES / "faulty.xml", "modelDescription.xml")
        archive.write(library, "binaries/linux64/faulty.so")
    return folder / "faulty.fmu"


def chain(folder: Path, bad="bad") -> Path:
    """Write a system: `good` counts steps in y, of which `bad` gives the double in z."""
    parts = [component(name, "faulty.fmu", "u> y< z<") for name in ("good", bad)]
    return write(folder, system(parts, [connection(f"good.y -> {bad}.u")]))


def demand(where: str, what: str, at: float = 0.0) -> dict[str, float]:
    """Return the start values by which `bad` does `what` in the function `where` from the time `at` in s on."""
    return {"bad.where": WHERE[where], "bad.what": WHAT[what], "bad.at": at}
