"""Files made to do harm: one line, at once, and nothing is expanded, fetched, followed or filled."""

import os
import resource
import struct
import subprocess
import sys
import time
import warnings
import zipfile

import lz4.frame
import pytest
import zstandard
from ssp_writer import HEAD, bind, component, edit_fmu, parameter_set, system, write

from twip.cosim import check, load
from twip.cosim.log import playback
from twip.cosim.reading.problems import Problems
from twip.cosim.run.checkpoint import Checkpoint
from twip.cosim.scenario.inputs import read_inputs
from twip.errors import TwipError

LAUGHS = "<!DOCTYPE x [<!ENTITY a0 'ha'>" + "".join(
    f"<!ENTITY a{i} '{f'&a{i - 1};' * 10}'>" for i in range(1, 30)
) + "]>"  # fmt: skip
EXTERNAL = "<!DOCTYPE x [<!ENTITY e SYSTEM 'file:///etc/passwd'>]>"
PARAMETER = "<!DOCTYPE x [<!ENTITY % p SYSTEM 'http://127.0.0.1:9/x.dtd'> %p;]>"
REMOTE = "<!DOCTYPE x SYSTEM 'http://127.0.0.1:9/x.dtd'>"
DOCTYPES = {
    "laughs": (LAUGHS, "&a29;"),
    "external": (EXTERNAL, "&e;"),
    "parameter": (PARAMETER, ""),
    "remote": (REMOTE, ""),
}


@pytest.fixture(autouse=True)
def harmless():
    """A test that takes long or needs memory fails."""
    began, before = time.monotonic(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    yield
    assert time.monotonic() - began < 10.0
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200 * 1024  # KiB


def refused(lines, *names):
    """Tell whether these are single lines, and which of the `names` some of them must have."""
    single = bool(lines) and all("\n" not in line and "Traceback" not in line for line in lines)
    return single and all(any(name in line for line in lines) for name in names)


@pytest.mark.parametrize("kind", DOCTYPES)
@pytest.mark.parametrize("place", ["text", "attribute", "nowhere"])
def test_document_types_and_entities_are_refused(folder, kind, place):
    doctype, entity = DOCTYPES[kind]
    name = entity if place == "attribute" else "k"
    text = entity if place == "text" else ""
    inner = parameter_set({name: ("Real", 1)}).replace("</ssv:Parameters>", f"{text}</ssv:Parameters>")
    (folder / "set.ssv").write_text(f"<?xml version='1.0'?>{doctype}{inner}")
    path = write(folder, system([component("a", "CosimGain.fmu")]))
    lines = check(path, parameters=[folder / "set.ssv"])
    assert len(lines) == 1
    assert refused(lines, "set.ssv")
    path.write_text(
        f"<?xml version='1.0'?>{doctype}{path.read_text().replace('</ssd:System>', f'{text}</ssd:System>')}"
    )
    lines = check(path)
    assert len(lines) == 1
    assert refused(lines, "SystemStructure.ssd")
    with zipfile.ZipFile(folder / "CosimGain.fmu") as archive:
        description = (
            archive.read("modelDescription.xml").decode().replace('<?xml version="1.0" encoding="UTF-8"?>', "")
        )
    data = f"{doctype}{description.replace('<ModelVariables>', f'<ModelVariables>{text}')}".encode()
    edit_fmu(folder / "CosimGain.fmu", folder / "evil.fmu", files={"modelDescription.xml": data})
    lines = check(write(folder, system([component("a", "evil.fmu")])))
    assert len(lines) == 1
    assert refused(lines, "evil.fmu: modelDescription.xml")


def test_inclusions_are_not_followed(folder):
    include = '<xi:include xmlns:xi="http://www.w3.org/2001/XInclude" href="/etc/passwd" parse="text"/>'
    path = write(folder, system([component("a", "CosimGain.fmu", inside=include)]))
    lines = check(path)
    assert refused(lines, "SystemStructure.ssd")
    assert not any("root:" in line for line in lines)


@pytest.mark.parametrize("source", ["/dev/zero", "file:///dev/zero", "pipe", "set/../../../../../../../dev/zero"])
def test_devices_and_pipes_are_not_read(folder, source):
    os.mkfifo(folder / "pipe")
    assert refused(check(write(folder, system([component("a", source)]))), "SystemStructure.ssd")
    parts = [component("a", "CosimGain.fmu", "", bind(source=source))]
    assert refused(check(write(folder, system(parts))), "SystemStructure.ssd")


def unpacked(folder, name):
    """Return the folder of an unpacked FMU."""
    with zipfile.ZipFile(folder / "CosimGain.fmu") as archive:
        archive.extractall(folder / name)
    return folder / name


def limited(*arguments):
    """Return what `twip` says on the error stream, in 20 s and with 2 GiB of memory, and its status."""
    limit = "import resource, sys; resource.setrlimit(resource.RLIMIT_AS, (2 << 30, 2 << 30))"
    command = f"{limit}; from twip.cli import main; sys.exit(main(sys.argv[1:]))"
    done = subprocess.run(
        [sys.executable, "-c", command, *map(str, arguments)], capture_output=True, text=True, timeout=20
    )
    return done.stderr.splitlines(), done.returncode


def test_devices_and_pipes_in_an_unpacked_fmu_are_not_read(folder):
    for name in ("piped", "endless", "hidden"):
        unpacked(folder, name)
    (folder / "piped/modelDescription.xml").unlink()
    os.mkfifo(folder / "piped/modelDescription.xml")
    (folder / "endless/modelDescription.xml").unlink()
    (folder / "endless/modelDescription.xml").symlink_to("/dev/zero")
    library = next((folder / "hidden").glob("binaries/*/*.so"))
    library.unlink()
    os.mkfifo(library)
    fine = unpacked(folder, "fine")
    os.mkfifo(fine / "resources/set.ssv")
    parts = [component(name, name) for name in ("piped", "endless", "hidden")]
    parts.append(component("fine", "fine", "", bind(source="resources/set.ssv", base="component")))
    lines, status = limited("check", write(folder, system(parts)))
    name = library.relative_to(folder / "hidden")
    told = [line.removeprefix("twip: ").strip().partition(" (")[0] for line in lines]
    assert status == 1
    assert sorted(told) == [
        "FMU endless cannot be read: modelDescription.xml is a device or the like, not a file",
        "FMU hidden has no binary for this platform",
        "FMU piped cannot be read: modelDescription.xml is a device or the like, not a file",
        "resources/set.ssv is a device or the like, not a file",
    ]
    assert any(f"({name})" in line for line in lines)


@pytest.mark.parametrize("kind", ["device", "fmu", "set", "description", "swap"])
def test_devices_and_pipes_named_on_the_command_line_are_not_read(folder, kind):
    path = write(folder, system([component("a", "CosimGain.fmu")]))
    pipes = {end: folder / f"pipe{end}" for end in (".fmu", ".ssv", ".ssd")}
    for pipe in pipes.values():
        os.mkfifo(pipe)
    lines, status = limited("check", *{
        "device": ["/dev/zero"], "fmu": [pipes[".fmu"]], "set": [path, "--parameters", pipes[".ssv"]],
        "description": [pipes[".ssd"]], "swap": [path, "--swap", f"a={pipes['.fmu']}"],
    }[kind])  # fmt: skip
    assert status == 1
    assert len(lines) == 1
    assert " is a device or the like, not a file" in lines[0]


def test_devices_as_time_series_and_logs_are_not_read(folder):
    path = write(folder, system([component("a", "CosimGain.fmu")]))
    assert limited("check", path, "--step-size", 0.5, "--input-file", "/dev/zero") == (
        ["twip: /dev/zero is a device, not a file"], 1,
    )  # fmt: skip
    lines, status = limited("report", "/dev/zero")
    assert (lines, status) == (["twip: log '/dev/zero' is a device, not a file"], 1)


def zipped(folder, entries, compression=zipfile.ZIP_STORED, name="evil.ssp"):
    with zipfile.ZipFile(folder / name, "w", compression) as file:
        for entry, data in entries:
            file.writestr(entry, data)
    return folder / name


@pytest.mark.parametrize(
    ("name", "what"),
    [
        ("../evil", "leads out of the archive"),
        ("a/../../evil", "leads out of the archive"),
        ("/tmp/evil", "leads out of the archive"),
        ("C:\\evil", "leads out of the archive"),
        ("..\\evil", "leads out of the archive"),
    ],
)
def test_names_that_lead_out_of_an_archive(folder, name, what):
    lines = check(zipped(folder, [("SystemStructure.ssd", "x"), (name, "evil")]))
    assert len(lines) == 1
    assert what in lines[0]
    assert str(folder / "evil.ssp") in lines[0]


@pytest.mark.parametrize("kind", [0o120000, 0o020000, 0o060000, 0o010000, 0o140000])
def test_links_devices_and_pipes_in_an_archive(folder, kind):
    entry = zipfile.ZipInfo("SystemStructure.ssd")
    entry.create_system, entry.external_attr = 3, (kind | 0o777) << 16
    lines = check(zipped(folder, [(entry, "/etc/passwd")]))
    assert len(lines) == 1
    assert "'SystemStructure.ssd' is a " in lines[0]


@pytest.mark.parametrize("names", [("a", "a"), ("x/a", "x//a"), ("a", "./a")])
def test_names_that_meet_in_an_archive(folder, names):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # zipfile's
        path = zipped(folder, [("SystemStructure.ssd", "x"), *((name, "1") for name in names)])
    lines = check(path)
    assert len(lines) == 1
    assert "is there twice" in lines[0]


def test_a_bomb_is_refused_before_it_is_unpacked(folder):
    path = zipped(folder, [("SystemStructure.ssd", "x"), ("zeros", bytes(150 << 20))], zipfile.ZIP_DEFLATED)
    assert path.stat().st_size < 1 << 20
    lines = check(path)
    assert len(lines) == 1
    assert lines[0].endswith("bytes are no honest archive")


def test_a_bomb_that_lies_about_its_size(folder):
    data = bytes(50 << 20)
    path = zipped(folder, [("SystemStructure.ssd", data)], zipfile.ZIP_DEFLATED)
    raw = path.read_bytes()
    path.write_bytes(raw.replace(struct.pack("<I", len(data)), struct.pack("<I", 10)))
    lines = check(path)
    assert refused(lines, "evil.ssp")


def test_a_deep_document_and_a_wide_one(folder):
    body = "<ssd:Elements><ssd:System name='s'>" * 5000 + "</ssd:System></ssd:Elements>" * 5000
    path = write(folder, f"<ssd:System name='r'>{body}</ssd:System>")
    assert len(check(path)) == 1
    body = "<ssd:Elements><ssd:System name='s'>" * 100 + "</ssd:System></ssd:Elements>" * 100
    path = write(folder, f"<ssd:System name='r'>{body}</ssd:System>")
    assert refused(check(path))
    path.write_text(f'{HEAD} version="1.0" name="{"n" * 20_000_000}"/>')
    lines = check(path)
    assert refused(lines, "SystemStructure.ssd")
    assert max(map(len, lines)) < 2200


@pytest.mark.parametrize("number", ["1e999", "-1e999", "nan", "inf", "9" * 5000, "0x1p3", "1_0", "--1", "１", ""])
@pytest.mark.parametrize("name", ["a.k", "m.n"])
def test_numbers_that_are_none(folder, number, name):
    (folder / "set.ssv").write_text(parameter_set({name: ("Integer" if name == "m.n" else "Real", number)}))
    path = write(folder, system([component("a", "CosimGain.fmu"), component("m", "CosimMixed.fmu")]))
    assert len(check(path, parameters=[folder / "set.ssv"])) >= 1


@pytest.mark.parametrize(
    "content", [b"\0\0\0", b"time,a.u\n0," + b"9" * 200_000, b'time,"a.u\n0,1', b"\xff\xfet\0i\0m\0e\0", b"time\n" * 3]
)
def test_tables_that_are_none(folder, content):
    (folder / "bad.csv").write_bytes(content)
    problems = Problems()
    with load(write(folder, system([component("a", "CosimGain.fmu")]))) as loaded:
        read_inputs(folder / "bad.csv", loaded, problems)
    assert len(problems.lines) == 1 or content.startswith(b"time\n")


def test_a_system_that_contains_itself(folder):
    parts = ['<ssd:Component name="me" type="application/x-ssp-definition" source="SystemStructure.ssd"/>']
    lines = check(write(folder, system(parts)))
    assert refused(lines, "SystemStructure.ssd")


@pytest.mark.parametrize("name", ["system.txt", "system.ssp", "system.fmu", "system"])
def test_files_that_are_something_else(folder, name):
    (folder / name).write_text("hello")
    assert refused(check(folder / name), name)


def test_control_characters_do_not_reach_the_terminal(folder):
    path = write(folder, system([component("a", "CosimGain.fmu")]))
    assert all(line.isprintable() for line in check(path, start_values={"a.\x1b[2J\x07\u202e": 1}))
    with pytest.raises(TwipError) as failure:
        load(folder / "\x1b[2J.ssp")
    assert str(failure.value).isprintable()


def chunk(compression, data, size):
    name = compression.encode()
    inner = struct.pack("<QQQII", 0, 1, size, 0, len(name)) + name + struct.pack("<Q", len(data)) + data
    return b"\x89MCAP0\r\n" + struct.pack("<BQ", 6, len(inner)) + inner


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
@pytest.mark.parametrize("honest", [True, False])
def test_a_log_that_would_fill_the_memory(tmp_path, compression, honest):
    size = 2 << 30
    if compression == "zstd":
        maker = zstandard.ZstdCompressor().compressobj(size=size)
        zeros = bytes(1 << 20)
        data = b"".join([*(maker.compress(zeros) for _ in range(size >> 20)), maker.flush()])
    else:
        data = lz4.frame.compress(bytes(8 << 20), store_size=False) * 300
    (tmp_path / "run.mcap").write_bytes(chunk(compression, data, size if honest else 10))
    with pytest.raises(TwipError, match="would unpack to more than"):
        playback.read(tmp_path / "run.mcap")


def test_a_checkpoint_that_would_fill_the_memory(tmp_path):
    path = zipped(tmp_path, [("checkpoint.json", bytes(50 << 20))], zipfile.ZIP_DEFLATED, "run.checkpoint")
    with pytest.raises(TwipError, match="is not a readable checkpoint"):
        Checkpoint.read(path)
    path = zipped(tmp_path, [("checkpoint.json", "[" * 100_000)], name="run.checkpoint")
    with pytest.raises(TwipError, match="is not a readable checkpoint"):
        Checkpoint.read(path)
