"""Unpacked FMUs that stay for later runs: where, when anew, when not, and what the user is told."""

import os
import py_compile
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from flat_options import grouped
from ssp_writer import component, edit_fmu, system, write

from twip.cosim import Observer, Runtime, Table, load, simulate
from twip.cosim.fmus.fmu_cache import MARKER, awaits_compiling, cache_root
from twip.errors import TwipError

PATIENT = f'"""Looks for {MARKER}."""'
"""A file of an FMU that compiles its code where it finds the marker."""


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("TWIP_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def path(folder):
    return write(folder, system([component("m", "CosimMixed.fmu")]))


def run(path, **options):
    """Run and return the kept or temporary folder of the first component, and the messages."""
    with load(path) as loaded:
        table = Table(loaded.channels)
        simulate(loaded, sinks=[table], step_size=0.5, **grouped(loop="python", **options))
        fmu = loaded.components[0].fmu
        unpacked = loaded.unpacked.folder(fmu, pytest.fail)
        assert unpacked.is_dir()
        return unpacked, fmu, table.events


def kept(cache):
    return sorted(p.name for p in (cache / "fmus").iterdir())


def test_later_runs_use_the_same_folder_named_by_the_content(path, cache):
    first, fmu, events = run(path)
    assert first == cache / "fmus" / fmu.sha256[:32]
    assert (first / MARKER).is_file()
    assert events == []
    (first / "resources" / "compiled.nbi").touch()
    before = first.stat().st_ino
    assert run(path)[0] == first
    assert first.stat().st_ino == before
    assert (first / "resources" / "compiled.nbi").exists()
    assert kept(cache) == [fmu.sha256[:32]]


def test_another_content_has_another_folder(path, folder, cache):
    run(path)
    edit_fmu(folder / "CosimMixed.fmu", folder / "other.fmu", files={"resources/more.txt": b"x"})
    run(write(folder, system([component("m", "other.fmu")])))
    assert len(kept(cache)) == 2


@pytest.mark.parametrize("damage", ["marker", "missing", "size", "content"])
def test_a_damaged_folder_is_unpacked_anew(path, cache, damage):
    first, fmu, _ = run(path)
    script = first / "resources" / "cosim_mixed.py"
    text = script.read_text()
    if damage == "size":
        script.write_text(text[:-1])
    elif damage == "content":
        script.write_text(text.replace("0.25", "0.75"))
    else:
        (first / MARKER if damage == "marker" else script).unlink()
    assert run(path)[0] == first
    assert script.read_text() == text
    assert (first / MARKER).is_file()
    assert kept(cache) == [fmu.sha256[:32]]


def test_the_cache_lies_where_the_environment_says(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    assert cache_root() == tmp_path / "cache"
    monkeypatch.setenv("TWIP_CACHE", "")
    assert cache_root() == tmp_path / "xdg" / "twip"
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")  # to be ignored, says the XDG specification
    assert cache_root() == tmp_path / "home" / ".cache" / "twip"


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("caché", "has characters that some FMUs crash on"),
        ("a+b", "has characters that some FMUs crash on"),
        ("file", "cannot be written (Not a directory)"),
    ],
)
def test_without_a_usable_cache_the_run_unpacks_for_itself_and_says_so(path, tmp_path, monkeypatch, name, reason):
    (tmp_path / "file").touch()
    monkeypatch.setenv("TWIP_CACHE", str(tmp_path / name / "below"))
    with load(path) as loaded:
        table = Table(loaded.channels)
        simulate(loaded, sinks=[table], step_size=0.5)
        unpacked = loaded.unpacked.folder(loaded.components[0].fmu, pytest.fail)
        assert unpacked.is_relative_to(loaded.workspace.path)
        assert not (unpacked / MARKER).exists()
    assert not unpacked.exists()
    [event] = table.events
    assert (event.level, event.source) == ("warning", "")
    assert event.text.startswith("FMUs are unpacked for this run only: ")
    assert reason in event.text
    assert len(table.times) == 3


def test_an_fmu_that_is_a_folder_is_copied_for_the_run_only(folder, cache):
    with zipfile.ZipFile(folder / "CosimMixed.fmu") as archive:
        archive.extractall(folder / "Mixed")
    path = write(folder, system([component("m", "Mixed")]))
    with load(path) as loaded:
        simulate(loaded, step_size=0.5)
        assert loaded.unpacked.folder(loaded.components[0].fmu, pytest.fail).is_relative_to(loaded.workspace.path)
    assert not cache.exists()


def test_an_archive_that_changes_after_it_was_read_is_refused(path, folder, cache):
    with load(path) as loaded:
        (folder / "CosimMixed.fmu").unlink()  # a link to the session's file
        edit_fmu(folder / "CosimGain.fmu", folder / "CosimMixed.fmu")
        with pytest.raises(TwipError, match=r"^FMU CosimMixed.fmu has changed since it was read$"):
            simulate(loaded, step_size=0.5)
    assert kept(cache) == []


def test_after_a_fatal_failure_this_process_leaves_the_folder_alone(folder, cache):
    path = write(folder, system([component("f", "CosimFaulty.fmu")]))
    with load(path, start_values={"f.fault": "raise"}) as loaded, pytest.raises(TwipError, match="returned fatal"):
        simulate(loaded, step_size=0.5)
    with load(path) as loaded:
        table = Table(loaded.channels)
        assert simulate(loaded, sinks=[table], step_size=0.5).steps == 2
        unpacked = loaded.unpacked.folder(loaded.components[0].fmu, pytest.fail)
        assert unpacked.is_relative_to(loaded.workspace.path)
    assert table.events == []
    assert len(kept(cache)) == 1


def test_processes_that_unpack_at_once_share_one_whole_folder(path, folder, cache):
    program = (
        "import sys\nfrom twip.cosim import Runtime, load, simulate\n"
        "with load(sys.argv[1]) as loaded:\n    sys.stdin.readline()\n"
        "    simulate(loaded, step_size=0.5, runtime=Runtime(loop='python'))\n"
        "    print(loaded.unpacked.folder(loaded.components[0].fmu, print))"
    )
    edit_fmu(
        folder / "CosimMixed.fmu", folder / "large.fmu", files={f"resources/{i}": bytes(10_000) for i in range(300)}
    )
    path = write(folder, system([component("m", "large.fmu")]))
    processes = [
        subprocess.Popen(
            [sys.executable, "-c", program, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        for _ in range(4)
    ]
    for process in processes:
        process.stdin.write("\n")
        process.stdin.flush()
    told = {process.communicate(timeout=60)[0].strip() for process in processes}
    assert {process.returncode for process in processes} == {0}
    [name] = kept(cache)
    assert told == {str(cache / "fmus" / name)}
    with zipfile.ZipFile(folder / "large.fmu") as archive:
        for entry in archive.infolist():
            assert (cache / "fmus" / name / entry.filename).read_bytes() == archive.read(entry)


@pytest.fixture
def patient(folder):
    edit_fmu(folder / "CosimMixed.fmu", folder / "patient.fmu", files={"resources/own/kernel.py": PATIENT.encode()})
    return write(folder, system([component("a", "patient.fmu"), component("b", "patient.fmu")]))


def test_the_user_is_told_before_fmus_compile_for_the_first_time(patient):
    told = []
    unpacked, _, _ = run(patient, notice=told.append)
    assert told == ["compiling patient.fmu: needed once per build, takes a while"]
    (unpacked / "resources" / "own" / "kernel.nbi").touch()
    run(patient, notice=told.append)
    assert len(told) == 1


@pytest.mark.parametrize("compiled", [False, True])
def test_a_read_only_folder_is_used_only_with_compiled_code(patient, cache, monkeypatch, compiled):
    told = []
    first, _, _ = run(patient, notice=told.append)
    if compiled:
        (first / "resources" / "own" / "kernel.nbi").touch()
    # The superuser may write everywhere, so the permission is not taken from the file system.
    access = os.access
    monkeypatch.setattr("os.access", lambda p, mode: not Path(p).is_relative_to(cache) and access(p, mode))
    unpacked, _, events = run(patient, notice=told.append)
    assert (unpacked == first) is compiled
    texts = [f"FMUs are unpacked for this run only: {first} is read-only and holds no compiled code"]
    assert [event.text for event in events] == ([] if compiled else texts)
    assert len(told) == 1


def test_nothing_is_told_without_numba(patient, monkeypatch):
    told = []
    monkeypatch.setattr("twip.cosim.run.starting.find_spec", lambda _: None)
    run(patient, notice=told.append)
    assert told == []


def test_nothing_is_told_of_fmus_that_do_not_compile(path):
    told = []
    assert not awaits_compiling(run(path, notice=told.append)[0])
    assert told == []


@pytest.mark.parametrize("cached", [False, True])
def test_the_user_is_told_before_the_loop_is_compiled(path, monkeypatch, cached):
    monkeypatch.setattr("twip.cosim.coupling.compiled_loop.is_cached", lambda: cached)
    told = []
    with load(path) as loaded:
        simulate(loaded, step_size=0.5, runtime=Runtime(loop="compiled"), observer=Observer(notice=told.append))
    assert told == ([] if cached else ["compiling the loop: needed once per build, takes a while"])


def test_bytecode_that_was_cut_off_on_a_full_disk_is_made_anew(path, monkeypatch):
    """Python 3.11 takes a short write of bytecode for a whole one, and fails at it ever after."""
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    kept, _, _ = run(path)
    (kept / "resources" / "by_hand.py").write_text("answer = 42\n")
    written = Path(py_compile.compile(str(kept / "resources" / "by_hand.py"), doraise=True))
    whole = written.read_bytes()
    for cut in (whole[:-3], whole[:16], whole[:5], b""):
        written.write_bytes(cut)
        run(path)
        assert not written.exists()
    written.write_bytes(whole)
    run(path)
    assert written.read_bytes() == whole
