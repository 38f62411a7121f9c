"""Thousands of damaged files of each kind: each is read, or refused in clear lines; nothing else, and not slowly.

`pytest -m heavy tests/cosim/test_fuzz.py` reads 10 000, in some three minutes.
"""

import random
import signal
import traceback
import zipfile

import mutate
import pytest
from echo_fmu import echo3, echo3_description
from ssp_writer import (
    HEAD,
    bind,
    component,
    connection,
    dictionary,
    edit_fmu,
    linear,
    mapping,
    parameter_mapping,
    parameter_set,
    signals,
    system,
    units,
    write,
)

from twip.cosim import Checkpoints, Inputs, Runtime, check, load, simulate
from twip.cosim.log import playback
from twip.cosim.model.time_grid import time_grid
from twip.cosim.reading.problems import Problems
from twip.cosim.run.checkpoint import Checkpoint
from twip.cosim.scenario.inputs import NO_INPUTS
from twip.cosim.scenario.scenario_file import read_scenario
from twip.cosim.sinks.mcap_log import Attachment, McapLog
from twip.cosim.ssp import schemas
from twip.errors import TwipError

SLOW = 20
"""Most that one file may take, in s; machines may be busy."""
SHARES = {
    "ssd": 6, "ssv": 3, "ssm": 1, "ssb": 1, "csv": 3, "toml": 3, "mcap": 3, "checkpoint": 2, "ssp": 1,
    "fmi2": 2, "fmi3": 3,
}  # fmt: skip
"""Kinds of files and how many of each there are; `fmi2` and `fmi3` are model descriptions."""
TOML = """\
description = "all kinds of entries"
input_file = "drive.csv"

[inputs]
"m.held" = [[0.0, 1.0], [0.5, 2.0]]

[[faults]]
signal = "a.y"
kind = "bias"
value = 0.5
start = 0.25
stop = 0.5

[[faults]]
signal = "b.u"
kind = "dropout"
start = 0.75

[[faults]]
signal = "a.z"
kind = "delay"
value = 0.1

[[parameters]]
time = 0.5
name = "m.label"
value = "late"
"""
CSV = "time,drive,m.n,m.on\n0,1.5,2,true\n0.25,2.5,3,false\n0.25,-1e-3,4,1\n1.0,3,5,0\n"


@pytest.fixture(scope="module")
def samples(fmus, tmp_path_factory):
    """A folder with a whole file of each kind, which is also where the damaged ones go."""
    folder = tmp_path_factory.mktemp("fuzz")
    for fmu in ("CosimGain", "CosimMixed", "CosimIntegrator"):
        (folder / f"{fmu}.fmu").write_bytes((fmus / f"{fmu}.fmu").read_bytes())
    library = folder / "echo3.so"
    library.write_bytes(b"never loaded")
    echo3(folder, library)
    inner = system(
        [component("g", "CosimGain.fmu", "u> y<", bind({"k": ("Real", 3)})), signals("bus", "bus", "speed>")],
        [connection("v -> g.u", linear(2, 1)), connection("g.y -> w"), connection("g.y -> bus.speed")],
        "v>:Real w<:Real", name="inner",
    )  # fmt: skip
    values = {"a.k": ("Real", 5), "b.k": ("Real", 0.5), "m.label": ("String", "x")}
    (folder / "set.ssv").write_text(parameter_set(values, units("m m=1", "ssv")))
    (folder / "gain.ssv").write_text(parameter_set({"gain": ("Real", 3)}))
    (folder / "map.ssm").write_text(parameter_mapping([("gain", "k", linear(2))]))
    (folder / "bus.ssb").write_text(dictionary({"speed": "<ssc:Real/>", "unused": "<ssc:Real/>"}))
    (folder / "drive.csv").write_text("time,drive\n0,0\n1,1\n")
    (folder / "scenario.toml").write_text(TOML)
    (folder / "inputs.csv").write_text(CSV)
    flipped = mapping("Boolean", {"true": "false", "false": "true"})
    body = system(
        [
            component("a", "CosimGain.fmu", "u> y< z<"),
            component("b", "CosimGain.fmu", "u> y<", bind(source="gain.ssv", mapped="map.ssm")),
            component("i", "CosimIntegrator.fmu", "u> x<"),
            component("m", "CosimMixed.fmu", "n> on> held> total< seen< inverted<"),
            component("m2", "CosimMixed.fmu", "n> on> smooth>"),
            inner,
            signals("bus", "bus", "speed<"),
        ],
        [
            connection("drive -> a.u"), connection("a.y -> b.u", linear(0.5)), connection("b.y -> inner.v"),
            connection("inner.w -> i.u", suppressUnitConversion="true"), connection("i.x -> result"),
            connection("m.inverted -> m2.on", flipped), connection("bus.speed -> m2.smooth"),
        ],
        "drive>:Real[deg] result<", bind(source="set.ssv"), dictionaries={"bus": "bus.ssb"},
    )  # fmt: skip
    tail = units("deg rad=1 factor=0.0174; rad rad=1; m m=1") + '<ssd:DefaultExperiment stopTime="1"/>'
    path = write(folder, body, tail=tail)
    text = path.read_text()
    assert check(path) == []
    with load(path) as loaded:
        log = McapLog(folder / "run.mcap", loaded.channels, {"run": {"a": "b"}}, [Attachment.file(path)])
        simulate(
            loaded,
            step_size=0.01,
            sinks=[log],
            inputs=Inputs(file=folder / "inputs.csv"),
            runtime=Runtime(loop="python"),
        )
    with zipfile.ZipFile(folder / "whole.ssp", "w") as file:
        for source in (path, *folder.glob("*.ss[vmb]"), *folder.glob("Cosim*.fmu")):
            file.write(source, source.name)
    with zipfile.ZipFile(folder / "CosimMixed.fmu") as file:
        (folder / "modelDescription.xml").write_bytes(file.read("modelDescription.xml"))
    (folder / "echo3.xml").write_text(echo3_description())
    gain = [edit_fmu(folder / "CosimGain.fmu", folder / "state.fmu", state=True)]
    one = write(folder, system([component("g", gain[0].name, "u> y<")]))
    with load(one) as loaded:
        simulate(
            loaded,
            step_size=0.1,
            checkpoints=Checkpoints(file=folder / "run.checkpoint"),
            runtime=Runtime(loop="python"),
        )
    one.unlink()
    path.write_text(text)
    return folder


class Slow(BaseException):
    """A file takes too long; no handler in the code under test may catch it."""


def too_slow(*_):
    raise Slow


ORIGINALS = {
    "ssd": "SystemStructure.ssd", "ssv": "set.ssv", "ssm": "map.ssm", "ssb": "bus.ssb", "csv": "inputs.csv",
    "toml": "scenario.toml", "mcap": "run.mcap", "checkpoint": "run.checkpoint", "ssp": "whole.ssp",
    "fmi2": "modelDescription.xml", "fmi3": "echo3.xml",
}  # fmt: skip
CHANGES = {
    "csv": mutate.table, "toml": mutate.toml, "mcap": mutate.mcap, "checkpoint": mutate.archive, "ssp": mutate.archive,
}  # fmt: skip
FMUS = {
    "fmi2": ("CosimMixed.fmu", "n> on> held> total< seen<"),
    "fmi3": ("echo3.fmu", "u> x< in_Int8> out_Int8< ins_Float64[1]> outs_String[2]<"),
}


class Reading:
    """How each kind of file is damaged and read."""

    def __init__(self, folder):
        self.folder = folder
        self.structure = (folder / "SystemStructure.ssd").read_text()
        self.system = load(folder / "SystemStructure.ssd")
        self.grid = time_grid(self.system, None, None, 0.01)

    def damaged(self, kind, random):
        return CHANGES.get(kind, mutate.xml)((self.folder / ORIGINALS[kind]).read_bytes(), random)

    def read(self, kind, data):
        """Read a damaged file as a run would; return the lines by which it is refused."""
        file = self.folder / f"damaged.{kind}"
        file.write_bytes(data)
        structure = self.folder / "using.ssd"
        try:
            if kind in ("ssd", "ssp"):
                return check(file)
            if kind == "ssv":
                return check(self.folder / "SystemStructure.ssd", parameters=[file])
            if kind in ("ssm", "ssb"):
                structure.write_text(self.structure.replace(ORIGINALS[kind], file.name))
                return check(structure)
            if kind in FMUS:
                source, ports = FMUS[kind]
                edit_fmu(self.folder / source, self.folder / "damaged.fmu", files={"modelDescription.xml": data})
                body = system([component("m", "damaged.fmu", ports)])
                structure.write_text(f'{HEAD} version="1.0" name="t">{body}</ssd:SystemStructureDescription>')
                return check(structure, start_values={"m.in_String": "x"} if kind == "fmi3" else {"m.label": "x"})
            if kind in ("csv", "toml"):
                problems = Problems()
                read_scenario(*((None, file) if kind == "csv" else (file, None)), self.system, self.grid, problems)
                return problems.lines
            if kind == "mcap":
                playback.read(file)
            else:
                found = Checkpoint.read(file)
                found.check(file, {"system": "root", "coupling": "jacobi", "components": ["g"]}, self.grid, NO_INPUTS)
                found.check(file, found.identity, self.grid, NO_INPUTS)
        except TwipError as error:
            return str(error).splitlines() or ["an empty message"]
        return []


def fuzz(folder, kind, first, count):
    """Read `count` damaged files; return what is wrong with the answers, and how many were refused."""
    wrong, refused = [], 0
    reading = Reading(folder)
    before = signal.signal(signal.SIGALRM, too_slow)
    try:
        for seed in range(first, first + count):
            data = reading.damaged(kind, random.Random(f"{kind} {seed}"))
            signal.alarm(SLOW)
            try:
                lines = reading.read(kind, data)
                refused += bool(lines)
                wrong += [f"{kind} {seed}: {line!r}" for line in lines if not line.isprintable() or len(line) > 2100]
            except Slow:
                wrong.append(f"{kind} {seed}: not read within {SLOW} s\n{traceback.format_exc(limit=-3)}")
            except Exception:
                wrong.append(f"{kind} {seed}: {traceback.format_exc(limit=-4)}")
            finally:
                signal.alarm(0)
    finally:
        signal.signal(signal.SIGALRM, before)
        reading.system.close()
    return wrong, refused


@pytest.mark.parametrize("kind", SHARES)
def test_damaged_files_are_read_or_refused(samples, kind):
    count = 500 * SHARES[kind] // sum(SHARES.values())
    wrong, refused = fuzz(samples, kind, 0, count)
    assert wrong == [], "\n".join(wrong[:10])
    assert refused > count // 4


@pytest.mark.heavy
@pytest.mark.parametrize("kind", SHARES)
def test_thousands_of_damaged_files_are_read_or_refused(samples, kind):
    count = 10_000 * SHARES[kind] // sum(SHARES.values())
    wrong, refused = fuzz(samples, kind, 1000, count)
    assert wrong == [], "\n".join(wrong[:10])
    assert refused > count // 4


@pytest.mark.parametrize("kind", ["ssd", "ssv", "ssm", "ssb"])
def test_the_readers_stand_without_the_schemas(samples, kind, monkeypatch):
    """As version 2 is read where its schemas are not installed."""
    monkeypatch.setattr(schemas, "schema_folder", lambda _: None)
    wrong, refused = fuzz(samples, kind, 50_000, 40)
    assert wrong == [], "\n".join(wrong[:10])
    assert refused > 5
