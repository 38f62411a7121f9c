"""Hosts that are no Python: programs in C for Linux, Windows and 64-bit ARM, and a module for WebAssembly.

A plan says what they run: the FMU's parameters, its inputs row by row, and which outputs are written. All numbers are
doubles, so that one file serves every machine (host/cycle.h).
"""

import hashlib
import os
import shutil
import struct
import subprocess
import sys
import zipfile
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import fmpy
from fmi_replay import at, table

from twip.fmi.blocks import block_folders
from twip.fmi.native.block_source import FREESTANDING, RUNTIME
from twip.fmi.native.toolchain import FLAGS, PLATFORMS, Platform

FOLDER = Path(__file__).parent / "host"
HEADERS = Path(fmpy.__file__).parent / "c-code"
PLATFORM = {p.fmi3: p for p in PLATFORMS}
WARNINGS = ("-std=c11", "-O1", "-Wall", "-Wextra", "-Werror", "-Wno-unused-function")
KINDS = {"Real": 0.0, "Float64": 0.0, "Integer": 1.0, "Int32": 1.0, "Boolean": 2.0}
CYCLES = 50
NO_PYTHON = {"PATH": ""}
"""An environment in which no Python can be found."""


@dataclass(frozen=True)
class Machine:
    """A machine that runs programs in C, or is imitated here."""

    platform: Platform
    compiler: tuple[str, ...]
    launcher: tuple[str, ...] = ()
    environment: dict[str, str] = field(default_factory=lambda: dict(NO_PYTHON))
    ending: str = ""

    def library(self, unpacked, version):
        """Return the library of an unpacked FMU for this machine."""
        folder = self.platform.fmi2 if version == "2.0" else self.platform.fmi3
        (found,) = (unpacked / "binaries" / folder).iterdir()
        return found

    def compiled(self, folder, version):
        """Return the host as a program for this machine."""
        program = folder / f"host_{self.platform.fmi3}_{version[0]}{self.ending}"
        if not program.exists():
            assert shutil.which(self.compiler[0]), f"{self.compiler[0]} is missing; see .ci/run"
            options = [*WARNINGS, f"-DFMI_VERSION={version[0]}", f"-I{HEADERS}"]
            links = [] if self.ending else ["-ldl"]
            run([*self.compiler, *options, "-o", program, FOLDER / "host.c", *links], None)
        return program

    def run(self, program, unpacked, version, plan, rows, cycles=CYCLES):
        """Run the plan and return the bytes of the outputs; the state is left beside `rows`."""
        library = self.library(unpacked, version)
        words = [library, token(unpacked), plan, rows, rows.with_suffix(".state"), cycles]
        run([*self.launcher, program, *words], self.environment)
        return rows.read_bytes()


def run(command, environment):
    """Run a command; one that fails or says something fails the test."""
    done = subprocess.run(
        list(map(str, command)), env=environment, capture_output=True, text=True, timeout=600, check=False
    )
    said = done.stdout + done.stderr
    assert (done.returncode, said) == (0, ""), f"{command}: {said}"


LINUX = Machine(PLATFORM["x86_64-linux"], ("cc",))
ARM = Machine(
    PLATFORM["aarch64-linux"], ("aarch64-linux-gnu-gcc",), ("/usr/bin/qemu-aarch64", "-L", "/usr/aarch64-linux-gnu")
)
HERE = Machine(PLATFORM["aarch64-linux"], ("cc",)) if os.uname().machine == "aarch64" else LINUX
"""This machine itself."""


@contextmanager
def windows(folder):
    """Give Wine as a machine; what it keeps is in `folder`, and it stays ready until the end."""
    places = [shutil.which("wine64"), "/usr/lib/wine/wine64"]
    (wine, *_) = [p for p in places if p and Path(p).exists()] or [""]
    assert wine, "wine64 is missing; see .ci/run"
    server = Path("/usr/lib/wine/wineserver64")
    environment = {
        **{"PATH": "", "HOME": str(folder), "WINEPREFIX": str(folder / "wine"), "WINEDEBUG": "-all"},
        **{"WINEDLLOVERRIDES": "mscoree,mshtml=", "LC_ALL": "C.UTF-8"},
    }
    (folder / "wine").mkdir()
    subprocess.run([server, "-p"], env=environment, check=True)
    try:
        subprocess.run([wine, "wineboot", "-i"], env=environment, stderr=subprocess.DEVNULL, check=True, timeout=300)
        compiler = ("x86_64-w64-mingw32-gcc", "-municode")
        yield Machine(PLATFORM["x86_64-windows"], compiler, (wine,), environment, ".exe")
    finally:
        subprocess.run([server, "-k"], env=environment, check=False)  # that of this folder alone


def web_assembly(unpacked, folder, plan, rows):
    """Build an FMU's sources (FMI 2.0) and the host as one module, run the plan in node, and return the outputs."""
    module = folder / "host.wasm"
    sources = sorted((unpacked / "sources").glob("*.c"))
    flags = [f for f in FLAGS if f != "-shared" and not f.startswith("-std")]
    options = ["-target", "wasm32-freestanding", *flags, "-std=c11", "-DFMI_VERSION=2"]
    options += [f"-I{path}" for path in (HEADERS, FOLDER, FOLDER / "library", unpacked / "sources")]
    exports = [f"-Wl,--export={n}" for n in ("run", "message", "__heap_base")]
    link = ["-Wl,--no-entry", *exports, "-Wno-unused-function"]
    files = [*sources, RUNTIME / FREESTANDING, FOLDER / "wasm.c"]
    run([sys.executable, "-m", "ziglang", "cc", *options, *link, "-o", module, *files], None)
    node = shutil.which("node")
    assert node, "node is missing; see .ci/run"
    run([node, FOLDER / "wasm.mjs", module, plan, rows], NO_PYTHON)
    return rows.read_bytes()


def unpack(fmu, folder):
    """Unpack an FMU and return its folder."""
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(folder)
    return folder


def token(unpacked):
    description = fmpy.read_model_description(str(unpacked))
    return description.guid or description.instantiationToken


def write_plan(path, unpacked, step_size, inputs, parameters, outputs):
    """Write a plan: `inputs` maps names to values by step, `parameters` names to values, `outputs` are names."""
    known = {v.name: v for v in fmpy.read_model_description(str(unpacked)).modelVariables}

    def variables(names):
        return [*(float(known[n].valueReference) for n in names), *(KINDS[known[n].type] for n in names)]

    rows = list(zip(*inputs.values(), strict=True))
    numbers = [step_size, float(len(rows)), *(float(len(part)) for part in (inputs, parameters, outputs))]
    numbers += variables(inputs) + variables(parameters) + variables(outputs) + list(parameters.values())
    numbers += [x for row in rows for x in row]
    path.write_bytes(struct.pack(f"<{len(numbers)}d", *map(float, numbers)))
    return path


def reference_plan(path, unpacked, block, step_size):
    """Write the plan of a block's reference run, and return the bytes that its outputs should be."""
    folder = block_folders()[block]
    names, driven = table(folder / "input.csv")
    header, expected = table(folder / "output.csv")
    rows = [at(k * step_size, driven)[1:] for k in range(len(expected) - 1)]
    inputs = dict(zip(names[1:], zip(*rows, strict=True), strict=True))
    write_plan(path, unpacked, step_size, inputs, {}, header[1:])
    return b"".join(struct.pack(f"<{len(header) - 1}d", *row[1:]) for row in expected)


def digest(content):
    return hashlib.sha256(content).hexdigest()
