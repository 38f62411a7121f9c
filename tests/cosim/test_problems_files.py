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
    line_of,
    linear,
    pack,
    parameter_set,
    proposing,
    system,
    units,
    write,
)

from twip.cosim import check, load, simulate
from twip.errors import TwipError

GAIN = "CosimGain.fmu"
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
    monkeypatch.setattr("twip.cosim.archive.MAXIMUM_BYTES", 1000)
    assert "exceed the limit" in check(pack(path, folder / "s.ssp", {GAIN: folder / GAIN}))[0]


def test_an_unpack_folder_with_special_characters_is_avoided(folder, monkeypatch):
    odd = folder / "é#+[1]"
    odd.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(odd))
    path = write(odd, system([component("a", GAIN)]))
    shutil.copy(folder / GAIN, odd / GAIN)
    with load(path) as loaded:
        assert simulate(loaded, step_size=0.5).steps == 2
    monkeypatch.setattr("twip.cosim.archive.FALLBACKS", ())
    with pytest.raises(TwipError, match="cannot hold unpacked FMUs"):
        load(path)


def test_mutated_files_never_raise_anything_but_problems(folder):
    (folder / "set.ssv").write_text(parameter_set({"a.k": ("Real", 5, "m")}, units("m m=1", "ssv")))
    inner = system([component("g", GAIN, "u> y<")], [connection("v -> g.u")], "v>:Real[m]", name="inner")
    elements = [component("a", GAIN, "u> k* y<[m]", bind({"k": ("Real", 2)})), inner]
    body = system(elements, [connection("a.y -> inner.v", linear(2))], inside=bind(source="set.ssv"))
    tail = units("m m=1") + proposing('stepSize="0.5"')
    generator = random.Random(1)
    tokens = [b"", b'"', b"<", b"nan", b"%00", b"..", b"[", b"9" * 400, b"a", b"input", b"output", b"//", b"\xff"]
    for version in ("1.0", "2.0"):
        path = write(folder, body, tail=tail, version=version)
        for target in (path, folder / "set.ssv"):
            original = target.read_bytes()
            words = [m.span() for m in re.finditer(rb"[\w.\-]+", original)]
            for _ in range(150):
                begin, end = generator.choice(words)
                target.write_bytes(original[:begin] + generator.choice(tokens) + original[end:])
                assert all(isinstance(line, str) and "\n" not in line for line in check(path))
            target.write_bytes(original)
        assert check(path) == []
