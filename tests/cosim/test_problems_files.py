"""Files that are broken, hostile or merely odd are refused, or read, without harm."""

import random
import re
import shutil
import zipfile

import pytest
from ssp_writer import (
    bind,
    component,
    connection,
    dictionary,
    enumerations,
    line_of,
    linear,
    mapping,
    pack,
    parameter_mapping,
    parameter_set,
    proposing,
    signals,
    system,
    units,
    write,
)

from twip.cosim import check, load, simulate
from twip.errors import TwipError

GAIN = "CosimGain.fmu"
MUTATIONS = 25
"""Of each file."""
ONE_GAIN = system([component("a", GAIN)])


def test_xml_that_is_broken_or_hostile(folder):
    path = folder / "SystemStructure.ssd"
    path.write_text("<a><b></a>")
    broken = "not well-formed XML: Opening and ending tag mismatch: b line 1 and a, line 1, column 11"
    assert check(path)[0] == f"{broken} (SystemStructure.ssd line 1)"
    path.write_text('<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/passwd">]><a>&x;</a>')
    assert check(path) == ["a document type declaration is not allowed (SystemStructure.ssd)"]
    path.write_bytes(b"")
    assert len(check(path)) == 1
    path.write_text("<a/>")
    assert check(path) == ["expected a SystemStructureDescription, found a (SystemStructure.ssd line 1)"]


def test_an_archive_a_folder_and_a_bare_file_are_the_same_system(folder):
    path = write(folder, system([component("a", "resources/g%20x.fmu", "u> y<")]))
    (folder / "resources").mkdir()
    shutil.copy(folder / GAIN, folder / "resources" / "g x.fmu")
    archive = pack(path, folder / "s.ssp", {"resources/g x.fmu": folder / GAIN})
    values = []
    for source in (path, folder, archive):
        with load(source) as loaded:
            values.append(simulate(loaded, step_size=0.5).values)
    assert values[0] == values[1] == values[2]


def test_archives_that_are_damaged_or_hostile(folder):
    path = write(folder, system([component("a", "../g.fmu")]))
    good = pack(path, folder / "good.ssp", {GAIN: folder / GAIN})
    assert check(good) == [
        f"source ../g.fmu leads out of the archive (SystemStructure.ssd line {line_of(path, 'g.fmu')})"
    ]
    (folder / "cut.ssp").write_bytes(good.read_bytes()[:-100])
    assert check(folder / "cut.ssp")[0].startswith(f"{folder}/cut.ssp: not a readable zip archive (")
    assert check(folder / "none.ssp") == [f"{folder}/none.ssp: no such file"]
    for entry in ("../evil.txt", "/evil.txt", "a/../../evil.txt", "C:\\evil.txt"):
        with zipfile.ZipFile(folder / "bad.ssp", "w") as archive:
            archive.write(path, "SystemStructure.ssd")
            archive.writestr(entry, "evil")
        assert check(folder / "bad.ssp")[0].endswith("leads out of the archive")
    link = zipfile.ZipInfo("link")
    link.external_attr = 0o120777 << 16
    with zipfile.ZipFile(folder / "bad.ssp", "w") as archive:
        archive.write(path, "SystemStructure.ssd")
        archive.writestr(link, "/etc/passwd")
    assert check(folder / "bad.ssp") == [f"{folder}/bad.ssp: entry 'link' is a link"]
    with zipfile.ZipFile(folder / "bad.ssp", "w") as archive:
        archive.writestr("other.ssd", "")
    assert check(folder / "bad.ssp") == [f"{folder}/bad.ssp: the archive holds no SystemStructure.ssd"]


def test_an_archive_larger_than_the_limit(folder, monkeypatch):
    path = write(folder, system([component("a", GAIN)]))
    monkeypatch.setattr("twip.cosim.reading.archive.MAXIMUM_BYTES", 1000)
    assert "exceed the limit" in check(pack(path, folder / "s.ssp", {GAIN: folder / GAIN}))[0]


def test_an_unpack_folder_with_special_characters_is_avoided(folder, monkeypatch):
    odd = folder / "é#+[1]"
    odd.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(odd))
    path = write(odd, system([component("a", GAIN)]))
    shutil.copy(folder / GAIN, odd / GAIN)
    with load(path) as loaded:
        assert simulate(loaded, step_size=0.5).steps == 2
    monkeypatch.setattr("twip.cosim.reading.archive.FALLBACKS", ())
    with pytest.raises(TwipError, match="cannot hold unpacked FMUs"):
        load(path)


def everything(folder, version):
    """Write a system that uses every part of the standard; return its files."""
    items = {"off": 0, "on": 3}
    (folder / "set.ssv").write_text(
        parameter_set({"gain": ("Real", 5, "m"), "mode": ("Integer", 3)}, units("m m=1", "ssv"))
    )
    (folder / "map.ssm").write_text(parameter_mapping([("gain", "a.k", linear(2)), ("mode", "m.n")]))
    (folder / "bus.ssb").write_text(dictionary({"s": '<ssc:Real unit="m"/>'}, units("m m=1", "ssb")))
    shutil.copy(
        write(folder, system([component("g", GAIN, "u> y<")], [connection("v -> g.u")], "v>:Real[m]")),
        folder / "inner.ssd",
    )
    inner = component("inner", "inner.ssd", "v>", bind({"g.k": ("Real", 2)}))
    elements = [
        component("a", GAIN, "u> k* y<[m]", bind({"k": ("Real", 2)})),
        component("m", "CosimMixed.fmu", "n>:Integer total<:Integer on>:Boolean inverted<:Boolean"),
        inner.replace(" source=", ' type="application/x-ssp-definition" source='),
        signals("r", "bus", "s~"),
    ]
    wires = [
        connection("a.y -> r.s"),
        connection("r.s -> inner.v", linear(2)),
        connection("m.total -> m.n", mapping("Integer", {3: 6})),
        connection("m.inverted -> m.on", mapping("Boolean", {"true": "false"})),
    ]
    body = system(elements, wires, "", bind(source="set.ssv", mapped="map.ssm"), dictionaries={"bus": "bus.ssb"})
    tail = enumerations(Mode=items) + units("m m=1") + proposing('stepSize="0.5"')
    return [
        write(folder, body, tail=tail, version=version),
        *(folder / n for n in ("set.ssv", "map.ssm", "bus.ssb", "inner.ssd")),
    ]


@pytest.mark.parametrize("version", ["1.0", "2.0"])
def test_mutated_files_never_raise_anything_but_problems(folder, version):
    generator = random.Random(1)
    tokens = [b"", b'"', b"<", b"nan", b"%00", b"..", b"[", b"9" * 400, b"a", b"input", b"output", b"//", b"\xff"]
    tokens += [b"inner", b"r", b"bus", b"inout", b"0", b"-1", b"inner.ssd", b"Integer", b"component", b"\xc3\xa4"]
    files = everything(folder, version)
    assert check(files[0]) == []
    for target in files:
        original = target.read_bytes()
        words = [m.span() for m in re.finditer(rb"[\w.\-]+", original)]
        for _ in range(MUTATIONS):
            begin, end = generator.choice(words)
            target.write_bytes(original[:begin] + generator.choice(tokens) + original[end:])
            assert all(isinstance(line, str) and "\n" not in line for line in check(files[0]))
        target.write_bytes(original)
