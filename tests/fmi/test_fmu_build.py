"""What the build packs: the same bytes for the same source, complete archives, and clear errors."""

import ast
import os
import shutil
import subprocess
import sys
import tomllib
import zipfile
from html.parser import HTMLParser
from pathlib import Path

import pytest
from fmi_blocks import OWN, OWN_BLOCKS, face_of

from twip.errors import TwipError
from twip.fmi.archive import write_archive
from twip.fmi.blocks import PACKAGE, block_folders, load_block, source_root
from twip.fmi.build import build_all, build_blocks
from twip.fmi.sources import carried_sources, rerooted
from twip.fmi.ssp_package import needed_fmus, package_system, system_folders

ROOT = Path(__file__).parents[2]


def build(face, output):
    build_blocks([(face, output)], lambda _: None)
    return output.read_bytes()


def changed(tmp_path, old, new, name="walker"):
    """A copy of one of this folder's blocks with a changed face."""
    text = face_of(name).read_text(encoding="utf-8")
    assert old in text
    face = tmp_path / f"{name}.py"
    face.write_text(text.replace(old, new), encoding="utf-8")
    return face


def test_the_same_source_gives_the_same_bytes(fmu_path, name, tmp_path):
    folder = tmp_path / "else where" / name
    shutil.copytree(face_of(name).parent, folder, ignore=shutil.ignore_patterns("__pycache__"))
    for path in folder.iterdir():
        os.utime(path, (1e9, 1e9))
        path.chmod(0o600)
    assert build(folder / f"{name}.py", tmp_path / "out" / f"{name}.fmu") == fmu_path(name).read_bytes()


def test_a_changed_source_changes_the_fingerprint(fmu_path, tmp_path):
    face = changed(tmp_path, "16807.0", "16807.5")
    build(face, tmp_path / "walker.fmu")
    names = [set(zipfile.ZipFile(p).namelist()) for p in (fmu_path("walker"), tmp_path / "walker.fmu")]
    packages = [{n.split("/")[1] for n in ns if n.startswith("resources/_twip_")} for ns in names]
    assert [len(p) for p in packages] == [1, 1]
    assert packages[0] != packages[1]


def test_the_archive_is_complete_and_lean(fmu_path, name):
    with zipfile.ZipFile(fmu_path(name)) as archive:
        assert archive.testzip() is None
        names = archive.namelist()
        assert names[0] == "modelDescription.xml"
        assert names[1:] == sorted(names[1:])
        assert {i.date_time for i in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
        assert {i.compress_type for i in archive.infolist()} == {zipfile.ZIP_STORED}
        assert f"binaries/linux64/{name}.so" in names
        assert not [n for n in names if "__pycache__" in n or "/tests/" in n]
        assert "MIT License" in archive.read("documentation/licenses/twip.txt").decode()
        assert "NTNU" in archive.read("documentation/licenses/pythonfmu.txt").decode()
        assert "pythonfmu" in archive.read("documentation/licenses/license.txt").decode()


def test_no_carried_module_imports_twip(fmu_path, name):
    with zipfile.ZipFile(fmu_path(name)) as archive:
        own = [n for n in archive.namelist() if n.startswith("resources/_twip_")]
        trees = [ast.parse(archive.read(n)) for n in own]
    assert len(own) > 5
    for node in (n for tree in trees for n in ast.walk(tree)):
        if isinstance(node, ast.ImportFrom) and node.level == 0:
            assert node.module.split(".")[0] != "twip"
        elif isinstance(node, ast.Import):
            assert "twip" not in {a.name.split(".")[0] for a in node.names}


def test_blocks_of_the_robot_have_an_icon_and_a_page_of_their_own(fmu_path, robot_block):
    with zipfile.ZipFile(fmu_path(robot_block)) as archive:
        icon = archive.read("model.png")
        page = archive.read("documentation/index.html").decode()
    assert icon.startswith(b"\x89PNG\r\n")
    assert len(icon) < 5000
    assert "<h1>" in page
    assert "<pre>" in page  # the equations of its README


class Nesting(HTMLParser):
    """Refuses tags that are not closed in order, links to the outside and scripts."""

    VOID = ("meta", "br", "hr", "img")

    def __init__(self):
        super().__init__()
        self.open, self.tags, self.text = [], [], ""

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        assert tag not in ("script", "link", "iframe")
        assert not [v for k, v in attrs if k == "src"]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data


def test_the_page_is_valid_and_names_every_variable(fmu_path, declared, name):
    with zipfile.ZipFile(fmu_path(name)) as archive:
        page = archive.read("documentation/index.html").decode()
    assert page.startswith("<!DOCTYPE html>")
    parser = Nesting()
    parser.feed(page)
    parser.close()
    assert parser.open == []
    assert [parser.tags.count(t) for t in ("html", "head", "title", "body", "h1")] == [1] * 5
    for v in declared(name).variables:
        if v.causality != "state":
            assert v.name in parser.text
            assert v.description in parser.text


def test_python_build_fmus_builds_in_place_from_the_command_line():
    run = subprocess.run(
        [sys.executable, ROOT / "build_fmus.py", "nothing"], capture_output=True, text=True, check=False
    )
    assert run.returncode == 1
    assert run.stderr.startswith("twip: no block nothing; there are ")


def test_everything_is_built(built):
    assert [p.stem for p in sorted((built / "fmus").iterdir())] == sorted(block_folders())
    for name in system_folders(source_root()):
        with zipfile.ZipFile(built / "ssp" / f"{name}.ssp") as archive:
            assert archive.namelist()[0] == "SystemStructure.ssd"
            for fmu in needed_fmus(ROOT / "ssp" / name):
                assert archive.read(f"resources/{fmu}.fmu") == (built / "fmus" / f"{fmu}.fmu").read_bytes()


def test_loose_parameter_sets_and_inputs_lie_beside_the_systems(built):
    loose = [p for p in (ROOT / "ssp").rglob("*") if p.suffix in (".ssv", ".csv", ".toml")]
    loose = [p for p in loose if not any((f / "SystemStructure.ssd").is_file() for f in p.parents)]
    assert loose
    for path in loose:
        assert (built / path.relative_to(ROOT)).read_bytes() == path.read_bytes()


def test_some_blocks_only(built, tmp_path):
    done = []
    assert build_all(tmp_path, ["imu"], done.append) == done == [tmp_path / "fmus" / "imu.fmu"]
    for fmu in (built / "fmus").iterdir():
        shutil.copyfile(fmu, tmp_path / "fmus" / fmu.name)
    paths = build_all(tmp_path, ["imu"])  # now the system that contains it can be packed
    assert paths == [tmp_path / "fmus" / "imu.fmu", tmp_path / "ssp" / "twip.ssp"]
    for path in paths:
        assert path.read_bytes() == (built / path.relative_to(tmp_path)).read_bytes()


def test_an_installed_package_builds_the_same_in_an_empty_folder(built, tmp_path):
    site, empty = tmp_path / "site", tmp_path / "empty"
    ignored = shutil.ignore_patterns("__pycache__", "*.fmu", "*.ssp")
    shutil.copytree(PACKAGE, site / "twip", ignore=ignored)
    for folder in ("fmus", "ssp"):
        shutil.copytree(ROOT / folder, site / "twip" / folder, ignore=ignored)
    shutil.copyfile(ROOT / "LICENSE", site / "twip" / "LICENSE")
    version = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    metadata = site / f"twip-{version}.dist-info" / "METADATA"
    metadata.parent.mkdir()
    metadata.write_text(f"Metadata-Version: 2.1\nName: twip\nVersion: {version}\n", encoding="utf-8")
    empty.mkdir()
    code = "from pathlib import Path; from twip.fmi.build import build_all; build_all(Path())"
    environment = {**os.environ, "PYTHONPATH": str(site), "PYTHONDONTWRITEBYTECODE": "1"}
    subprocess.run([sys.executable, "-c", code], cwd=empty, env=environment, check=True)
    files = {p.relative_to(built) for p in built.rglob("*") if p.is_file()}
    assert {p.relative_to(empty) for p in empty.rglob("*") if p.is_file()} == files
    assert [f for f in files if (empty / f).read_bytes() != (built / f).read_bytes()] == []


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('output("position", "m"', 'output("position", "furlong"', "walker: position [furlong]: the unit is not"),
        ("v.begun = time", "v.begun = time / 0.0", "ZeroDivisionError"),
        ("v.begun = time", "v.ended = time", "has no attribute 'ended'"),
        ("BLOCK = ", "BLOCKS = ", "a block must define BLOCK"),
        ('name="walker"', 'name="runner"', "the block is named 'runner', its file 'walker'"),
        ("from math import floor", "from math import flor", "cannot be imported: ImportError"),
        ("from math import floor", "import numpy\nfrom math import floor", "a block may import the standard library"),
        ("from math import floor", "import twip.robot\nfrom math import floor", "line 3: a block may import"),
        ("from math import floor", "from twip.errors import TwipError\nfrom math import floor", "not twip.errors"),
        ("from math import floor", "from math import floor; from twip.robot import kernel as k", None),
        ('depends=("pull",)', 'depends=("push",)', "pulled depends on push, which is not an input"),
        ("v.steps = 0.0", "v.position = 1e400 - 1e400", "position = nan m after initialization must be finite"),
    ],
)  # fmt: skip
def test_a_block_that_breaks_a_rule_is_refused(tmp_path, old, new, message):
    face = changed(tmp_path, old, new)
    if message is None:
        assert build(face, tmp_path / "walker.fmu")
        return
    with pytest.raises(TwipError) as refused:
        build(face, tmp_path / "walker.fmu")
    assert message in str(refused.value)
    assert not (tmp_path / "walker.fmu").exists()


def test_problems_of_all_blocks_are_told_together(tmp_path):
    faces = [changed(tmp_path, 'name="', 'name="not_', n) for n in OWN_BLOCKS]
    with pytest.raises(TwipError) as refused:
        build_blocks([(f, tmp_path / f"{f.stem}.fmu") for f in faces], lambda _: None)
    assert len(str(refused.value).splitlines()) == len(OWN_BLOCKS)


def test_rerooting_changes_the_imports_and_nothing_else():
    text = '"""from twip.robot import x"""\nfrom twip.robot.kernel import (\n    kernel,\n)\nfrom math import pi\n'
    expected = '"""from twip.robot import x"""\nfrom .robot.kernel import (\n    kernel,\n)\nfrom math import pi\n'
    assert rerooted(text, Path("face.py")) == expected
    for wrong in (
        "from . import x",
        "from .x import y",
        "import twip.robot.kernel",
        "from twip import robot",
        "import numpy",
    ):
        with pytest.raises(TwipError, match=r"face\.py, line 1"):
            rerooted(wrong, Path("face.py"))


def test_an_fmu_carries_what_its_block_needs_and_no_more():
    carried = set(carried_sources(face_of("walker"), "2.0"))
    assert {"face.py", "fmi/slave.py", "fmi/declare.py", "robot/kernel.py", "robot/__init__.py"} <= carried
    assert not {"fmi/build.py", "fmi/description.py", "errors.py", "__init__.py"} & carried


def test_an_archive_appears_whole_or_not_at_all(tmp_path):
    with pytest.raises(TypeError):
        write_archive(tmp_path / "a.zip", {"a": b"1", "b": None}, first="a")
    assert list(tmp_path.iterdir()) == []


def test_a_system_that_refers_to_nothing_is_refused(tmp_path):
    folder = tmp_path / "system"
    folder.mkdir()
    ssd = (
        '<SystemStructureDescription xmlns="http://ssp-standard.org/SSP1/SystemStructureDescription"><System><Elements>'
        '<Component name="a" source="resources/walker.fmu"/></Elements>{}</System></SystemStructureDescription>'
    )
    (folder / "SystemStructure.ssd").write_text(ssd.format(""), encoding="utf-8")
    with pytest.raises(TwipError, match=r"source resources/walker.fmu is neither there nor built"):
        package_system(folder, tmp_path, tmp_path / "system.ssp")
    (tmp_path / "walker.fmu").write_bytes(b"fmu")
    package_system(folder, tmp_path, tmp_path / "system.ssp")
    with zipfile.ZipFile(tmp_path / "system.ssp") as archive:
        assert archive.namelist() == ["SystemStructure.ssd", "resources/walker.fmu"]
    binding = '<ParameterBindings><ParameterBinding source="resources/set.ssv"/></ParameterBindings>'
    (folder / "SystemStructure.ssd").write_text(ssd.format(binding), encoding="utf-8")
    with pytest.raises(TwipError, match=r"no such file in .*: resources/set.ssv"):
        package_system(folder, tmp_path, tmp_path / "system.ssp")
    (folder / "SystemStructure.ssd").write_text("<", encoding="utf-8")
    with pytest.raises(TwipError, match=r"SystemStructure.ssd: "):
        package_system(folder, tmp_path, tmp_path / "system.ssp")


def test_an_output_folder_that_cannot_be_made_is_told(tmp_path):
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(TwipError, match="cannot be written"):
        build_blocks([(OWN / "walker" / "walker.py", tmp_path / "file" / "fmus" / "walker.fmu")], lambda _: None)


def test_a_face_that_is_not_there_is_told(tmp_path):
    with pytest.raises(TwipError, match="no such Python file"):
        load_block(tmp_path / "walker.py")
