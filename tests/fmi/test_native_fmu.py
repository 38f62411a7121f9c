"""A native FMU is the same FMU to its user: results, texts, states; and it needs nothing of its host."""

import ctypes
import re
import struct
import subprocess
import threading
import zipfile
from pathlib import Path

import fmpy
import fmpy.validation
import pytest
from fmi_blocks import BLOCKS, face_of
from fmi_host import DISCARD, ERROR, OK, WARNING
from fmi_replay import replay
from lxml import etree

from twip.cli import main
from twip.fmi.blocks import block_folders
from twip.fmi.native import toolchain
from twip.fmi.native.package import package_native

VERSIONS = ["2.0", "3.0"]
both = pytest.mark.parametrize("version", VERSIONS)


def errors(instance):
    return [text for status, category, text in instance.log if status == ERROR and category == "logStatusError"]


def set_status(instance, name, value):
    """Set one value and return the status."""
    kind = instance.fmu.types[name]
    reference = ctypes.c_uint(instance.fmu.references[name])
    types = {"Real": ctypes.c_double, "Float64": ctypes.c_double, "Boolean": ctypes.c_int, "Integer": ctypes.c_int}
    argument = types[kind](value)
    count = [ctypes.c_size_t(1)] if instance.fmu.variables[name].tag == kind else []
    return instance.call(f"Set{kind}", ctypes.byref(reference), ctypes.c_size_t(1), ctypes.byref(argument), *count)


@both
def test_it_matches_the_blocks_reference_output(native, robot_block, version):
    header, expected, found = replay(native(robot_block, version), block_folders()[robot_block])
    assert len(expected) > 100
    for k, (ours, theirs) in enumerate(zip(found, expected, strict=True)):
        assert ours == theirs, (k, header)


@both
@pytest.mark.parametrize("simple", ["motor", "imu", "typed", "walker"])
def test_all_its_variables_move_like_those_of_the_python_fmu(native, instance, simple, version):
    names = [n for n in native(simple, version).fmu.variables if n != "time"]

    def bits(one):
        return [struct.pack("d", one.get(n)) for n in names]

    pair = [native(simple, version).begin(start=0.0), instance(simple).begin(start=0.0)]
    size = pair[0].fmu.step_size
    for k in range(60):
        for one in pair:
            moved = {n.replace(".", "__"): 0.01 * ((k * 7 + i) % 11) for i, n in enumerate(one.fmu.of("input"))}
            one.set(**moved)
            assert one.step(k * size, size) == OK, one.log
        assert bits(pair[0]) == bits(pair[1]), k


def described(path):
    """The model description without what the flavours may have apart."""
    with zipfile.ZipFile(path) as archive:
        root = etree.fromstring(archive.read("modelDescription.xml"))
    for name in ("guid", "instantiationToken", "generationTool"):
        root.attrib.pop(name, None)
    co_simulation = root.find("CoSimulation")
    for name in ("needsExecutionTool", "canNotUseMemoryManagementFunctions"):
        co_simulation.attrib.pop(name, None)
    for parent, name in ((co_simulation, "SourceFiles"), (root, "VendorAnnotations")):
        for element in parent.findall(name):
            parent.remove(element)
    return [(e.tag, dict(e.attrib)) for e in root.iter()]


def test_it_is_described_like_the_python_fmu(native_path, fmu_path, robot_block):
    assert described(native_path(robot_block, "2.0")) == described(fmu_path(robot_block))
    with zipfile.ZipFile(native_path(robot_block, "2.0")) as ours, zipfile.ZipFile(fmu_path(robot_block)) as theirs:
        for file in ("model.png", "documentation/licenses/twip.txt"):
            assert ours.read(file) == theirs.read(file)
        pages = [a.read("documentation/index.html").split(b"<footer>")[0] for a in (ours, theirs)]
        assert pages[0] == pages[1]


def test_fmi3_finds_the_icon_where_it_looks(native_path):
    schema = Path(fmpy.__file__).parent / "schema" / "fmi3" / "fmi3TerminalsAndIcons.xsd"
    with zipfile.ZipFile(native_path("motor", "3.0")) as archive:
        xml = etree.fromstring(archive.read("terminalsAndIcons/terminalsAndIcons.xml"))
        assert archive.read("terminalsAndIcons/icon.png") == (block_folders()["motor"] / "model.png").read_bytes()
        assert "model.png" not in archive.namelist()
    etree.XMLSchema(etree.parse(schema)).assertValid(xml)
    assert xml.find("GraphicalRepresentation/Icon") is not None


@both
def test_fmpy_and_twip_find_nothing_wrong(native_path, robot_block, version, capsys):
    path = native_path(robot_block, version)
    assert fmpy.validation.validate_fmu(str(path)) == []
    assert main(["check", str(path)]) == 0
    assert "nothing is wrong" in capsys.readouterr().out


@both
def test_its_library_needs_nothing(native_loaded, robot_block, version):
    fmu = native_loaded(robot_block, version)
    run = subprocess.run(["readelf", "-d", "--dyn-syms", fmu.library._name], capture_output=True, text=True, check=True)
    assert "NEEDED" not in run.stdout
    undefined = re.findall(r" UND (\S+)", run.stdout)
    assert set(undefined) <= ({"calloc", "free"} if version == "3.0" else set())
    writable = [s for s in sections(fmu.library._name) if s in (".data", ".bss")]
    assert writable == []
    exported = re.findall(r"GLOBAL (?:DEFAULT|PROTECTED) +\d+ (\S+)", run.stdout)
    assert all(n.startswith(f"fmi{version[0]}") for n in exported)


def sections(library):
    run = subprocess.run(["readelf", "-SW", library], capture_output=True, text=True, check=True)
    return re.findall(r"\] (\.\S+)", run.stdout)


def test_the_fmus_libraries_are_for_all_platforms(tmp_path):
    contents = {}
    for version in VERSIONS:
        for attempt in range(2):
            path = tmp_path / f"{attempt}" / "walker.fmu"
            package_native(face_of("walker"), path, version)
            contents[version, attempt] = path.read_bytes()
        assert contents[version, 0] == contents[version, 1]
        with zipfile.ZipFile(path) as archive:
            libraries = {n: archive.read(n)[:4] for n in archive.namelist() if n.startswith("binaries/")}
        elf, macho, fat = b"\x7fELF", b"\xcf\xfa\xed\xfe", b"\xca\xfe\xba\xbe"
        fmi2 = {"linux64/walker.so": elf, "aarch64-linux/walker.so": elf, "win64/walker.dll": b"MZ",
                "darwin64/walker.dylib": fat}  # fmt: skip
        fmi3 = {"x86_64-linux/walker.so": elf, "aarch64-linux/walker.so": elf, "x86_64-windows/walker.dll": b"MZ",
                "x86_64-darwin/walker.dylib": macho, "aarch64-darwin/walker.dylib": macho}  # fmt: skip
        expected = {f"binaries/{n}": head for n, head in (fmi2 if version == "2.0" else fmi3).items()}
        assert set(libraries) == set(expected)
        assert all(libraries[n].startswith(head) for n, head in expected.items())


def test_without_zig_the_machines_compiler_serves_this_machine(tmp_path, monkeypatch):
    monkeypatch.setattr(toolchain, "_zig", lambda: None)
    package_native(face_of("walker"), tmp_path / "walker.fmu", "2.0")
    with zipfile.ZipFile(tmp_path / "walker.fmu") as archive:
        libraries = [n for n in archive.namelist() if n.startswith("binaries/")]
    machine = toolchain.this_machine()
    assert libraries == [f"binaries/{machine.fmi2}/walker.{machine.ending}"]
    fmpy.simulate_fmu(str(tmp_path / "walker.fmu"))


def test_without_any_compiler_one_line_says_what_to_install(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(toolchain, "_zig", lambda: None)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert main(["build", "motor", "--native", "--out", str(tmp_path)]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "pip install 'twip[native]'" in line
    assert not list(tmp_path.rglob("*.fmu"))


def sources_of(path, folder):
    """Unpack the sources of an FMU; return the C files that its description lists."""
    with zipfile.ZipFile(path) as archive:
        archive.extractall(folder)
        names = archive.namelist()
    if "sources/buildDescription.xml" in names:
        root = etree.parse(folder / "sources" / "buildDescription.xml").getroot()
        return [str(folder / "sources" / e.get("name")) for e in root.iter("SourceFile")]
    root = etree.parse(folder / "modelDescription.xml").getroot()
    return [str(folder / "sources" / e.get("name")) for e in root.iter("File")]


@both
def test_its_sources_build_by_themselves(native_path, tmp_path, version):
    """As a shared library, and with prefixed names next to another FMU in one program."""
    strict = ["cc", "-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-Wno-unused-function", "-pedantic"]
    sources = {n: sources_of(native_path(n, version), tmp_path / n) for n in ("walker", "typed")}
    override = f"-DFMI{version[0]}_OVERRIDE_FUNCTION_PREFIX"
    shared = [*strict, "-shared", "-fPIC", override, *sources["walker"], "-o", str(tmp_path / "walker.so")]
    subprocess.run(shared, check=True)
    ctypes.CDLL(str(tmp_path / "walker.so"))[f"fmi{version[0]}DoStep"]
    prefixed = [f"{name}_fmi{version[0]}GetVersion" for name in sources]
    calls = " && ".join(f'!strcmp({name}(), "{version}")' for name in prefixed)
    declared = "\n".join(f"const char *{name}(void);" for name in prefixed)
    main_c = f"#include <string.h>\n{declared}\nint main(void) {{ return {calls} ? 0 : 1; }}\n"
    (tmp_path / "main.c").write_text(main_c)
    program = [*strict, str(tmp_path / "main.c"), *sources["walker"], *sources["typed"], "-o", str(tmp_path / "both")]
    subprocess.run([*program], check=True)
    subprocess.run([str(tmp_path / "both")], check=True)


@both
@pytest.mark.parametrize("value", [float("nan"), float("inf"), float("-inf")])
@pytest.mark.parametrize("late", [False, True])
def test_a_value_that_is_not_finite_is_refused(native, value, late, version):
    one = native("walker", version)
    if late:
        one.begin()
    else:
        one.enter()
    assert set_status(one, "pull", value) == ERROR
    assert one.get("pull") == 0.25
    if not late:
        assert one.call("ExitInitializationMode") == ERROR
    assert one.step(0.0, 0.01) == ERROR
    assert errors(one) == [f"pull = {value:g} m must be finite"]
    assert one.log[-1][2] == f"no step from 0 s, because of: pull = {value:g} m must be finite"


@both
def test_a_parameter_out_of_bounds_is_refused_and_remembered(native, version):
    one = native("walker", version)
    one.enter()
    assert set_status(one, "gain", -0.5) == DISCARD
    assert one.log == [(DISCARD, "logStatusDiscard", "gain = -0.5 1/s must be at least 0 1/s")]
    assert one.get("gain") == 1.0
    assert one.call("ExitInitializationMode") == ERROR
    assert errors(one) == ["gain = -0.5 1/s must be at least 0 1/s"]
    assert one.step(0.0, 0.01) == ERROR
    one.check("Reset")
    one.enter()
    assert set_status(one, "gain", 11.0) == DISCARD
    one.set(gain=2.0)
    one.check("ExitInitializationMode")
    assert one.step(0.0, 0.01) == OK
    assert set_status(one, "gain", 11.0) == DISCARD
    assert one.step(0.01, 0.01) == ERROR
    assert errors(one)[-1] == "gain = 11 1/s must be at most 10 1/s"


def test_bounds_of_every_parameter_are_kept_with_pythons_texts(native, instance, declared, robot_block):
    for p in (p for p in declared(robot_block).variables if p.causality == "parameter" and p.minimum is not None):
        value = int(p.minimum) - 1
        one, other = native(robot_block), instance(robot_block).begin(**{p.name.replace(".", "__"): value})
        one.enter()
        assert set_status(one, p.name, value) == DISCARD
        assert one.call("ExitInitializationMode") == ERROR
        assert errors(one) == errors(other)


RULES = {
    "plant": {"bump_height": 0.01, "bump_length": 0.2, "bump_spacing": 0.1},
    "controller": {"c1": 0.0, "c3": 0.0},
    "imu": {"gyro_range": 1e-3, "gyro_resolution": 0.5},
    "estimator": {"low_pass_bandwidth": 1234.5},
    "fragile": {"lower": 3.0},
}


@both
@pytest.mark.parametrize("ruled", RULES)
def test_rules_between_parameters_have_pythons_texts(native, declared, ruled, version):
    block = declared(ruled)
    values = type("Values", (), {})()
    for v in block.variables:
        setattr(values, v.attribute, RULES[ruled].get(v.name, float(v.start or 0.0)))
    expected = block.check(values)
    assert expected
    one = native(ruled, version)
    one.enter()
    one.set(**RULES[ruled])
    assert one.call("ExitInitializationMode") == ERROR
    assert errors(one) == expected


@both
def test_what_cannot_be_set_is_refused(native, version):
    one = native("walker", version).begin()
    assert set_status(one, "position", 1.0) == ERROR
    assert set_status(one, "steps", 1.0) == ERROR
    assert set_status(one, "position_start", 1.0) == ERROR
    real = "Real" if version == "2.0" else "Float64"
    count = [] if version == "2.0" else [ctypes.c_size_t(1)]
    for function in ("Get", "Set"):
        unknown, value = ctypes.c_uint(4711), ctypes.c_double()
        assert (
            one.call(f"{function}{real}", ctypes.byref(unknown), ctypes.c_size_t(1), ctypes.byref(value), *count)
            == ERROR
        )
    assert errors(one) == [
        "position cannot be set: its causality is output",
        "steps cannot be set: its causality is local",
        "position_start is a fixed parameter: it cannot be set after initialization",
        *[f"value reference 4711 is no {real} variable of block walker"] * 2,
    ]
    one.check("Terminate")
    assert set_status(one, "pull", 1.0) == ERROR
    assert errors(one)[-1] == "pull cannot be set after termination"


@both
def test_a_step_that_yields_no_number_fails(native, version):
    one = native("fragile", version).begin()
    assert one.step(0.0, 1e-3) == OK
    state = one.save()
    assert set_status(one, "overflow", 1) == OK
    assert one.step(1e-3, 1e-3) == ERROR
    assert errors(one) == ["result = nan after the step from 0.001 s by 0.001 s must be finite"]
    assert one.step(1e-3, 1e-3) == ERROR
    one.restore(state)
    one.release(state)
    assert one.step(1e-3, 1e-3) == OK
    one = native("fragile", version)
    one.enter()
    assert set_status(one, "overflow", 1) == OK
    assert one.call("ExitInitializationMode") == ERROR
    assert errors(one) == ["result = inf after initialization must be finite"]


@both
@pytest.mark.parametrize(("time", "size"), [(0.0, 0.0), (0.0, -1.0), (0.0, float("nan")), (float("inf"), 0.01)])
def test_a_step_needs_a_begin_and_a_length(native, time, size, version):
    one = native("walker", version).begin()
    assert one.step(time, size) == ERROR
    assert errors(one) == [f"the step from {time:g} s by {size:g} s needs a finite begin and a positive length"]


@both
def test_calls_out_of_turn_are_refused_and_harmless(native, version):
    one = native("walker", version)
    assert one.call("ExitInitializationMode") == ERROR
    assert one.call("Terminate") == ERROR
    one.begin()
    assert one.call("ExitInitializationMode") == ERROR
    assert one.step(0.0, 0.01) == OK


@both
def test_it_warns_once_of_ticks_between_steps(native, instance, version):
    pair = [native("walker", version), instance("walker")]
    for one in pair:
        one.begin(sample_time=0.013)
        assert one.step(0.0, 0.01) == one.step(0.01, 0.01) == OK
    assert pair[0].log == pair[1].log
    assert [(s, c) for s, c, _ in pair[0].log] == [(WARNING, "logStatusWarning")]


@both
def test_reset_forgets_everything(native, version):
    one = native("walker", version).begin(start=1.0, gain=3.0, pull=0.5)
    first = [struct.pack("d", one.get(n)) for n in one.fmu.variables if n != "time"]
    one.step(1.0, 0.01)
    one.check("Reset")
    one.begin(start=1.0, gain=3.0, pull=0.5)
    assert [struct.pack("d", one.get(n)) for n in one.fmu.variables if n != "time"] == first
    one.check("Reset")
    assert one.get("gain") == 1.0


@both
def test_outputs_follow_inputs_while_initializing(native, version):
    one = native("walker", version)
    one.enter()
    one.set(pull=1.0, position_start=2.0)
    assert one.get("pulled") == 3.0
    one.set(pull=2.0)
    assert one.get("pulled") == 4.0


@both
def test_a_state_goes_to_another_instance(native, robot_block, version):
    one, other = native(robot_block, version).begin(), native(robot_block, version)
    one.run(0, 20)
    state = one.save()
    data = one.serialize(state)
    expected = one.run(20, 20)
    one.restore(state)
    assert one.run(20, 20) == expected
    one.release(state)
    restored = other.deserialize(data)
    other.restore(restored)
    other.release(restored)
    assert other.run(20, 20) == expected


@both
def test_bytes_that_are_no_state_are_refused(native, version):
    one, other = native("walker", version).begin(), native("typed", version).begin()
    state = one.save()
    data = one.serialize(state)
    one.release(state)
    damaged = bytearray(data)
    damaged[60:64] = b"\xff\xff\xff\xff"
    call = "DeSerializeFMUstate"
    for wrong in (b"", b"abc", data[:-8], bytes(damaged), bytes(len(data))):
        place = ctypes.c_void_p()
        assert one.call(call, wrong, ctypes.c_size_t(len(wrong)), ctypes.byref(place)) == ERROR
    place = ctypes.c_void_p()
    assert other.call(call, data, ctypes.c_size_t(len(data)), ctypes.byref(place)) == ERROR
    assert "cannot be restored into it" in other.log[-1][2]
    assert one.step(0.0, 0.01) == OK


def test_many_instances_in_many_threads_do_not_touch_each_other(native):
    instances = [native("plant").begin(pitch_start=0.001 * i) for i in range(16)]
    rows = {}

    def run(i):
        rows[i] = instances[i].run(0, 40)[-1]

    threads = [threading.Thread(target=run, args=(i,)) for i in range(16)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    alone = [native("plant").begin(pitch_start=0.001 * i).run(0, 40)[-1] for i in range(16)]
    assert [rows[i] for i in range(16)] == alone


def test_an_instance_is_made_of_the_hosts_memory(native, native_loaded):
    """FMI 2.0: every allocation is the host's, and all of it is given back."""
    fmu = native_loaded("plant", "2.0")
    memory, freed = {}, []

    def allocate(count, size):
        block = ctypes.create_string_buffer(count * size)
        memory[ctypes.addressof(block)] = block
        return ctypes.addressof(block)

    one = native("plant")
    callbacks = type(one.callbacks)(
        one.callbacks.logger, type(one.callbacks.allocate)(allocate), type(one.callbacks.free)(freed.append)
    )
    instantiate = fmu.library.fmi2Instantiate
    handle = instantiate(b"one", 1, fmu.guid.encode(), None, ctypes.byref(callbacks), 0, 0)
    state = ctypes.c_void_p()
    assert fmu.library.fmi2GetFMUstate(ctypes.c_void_p(handle), ctypes.byref(state)) == OK
    assert len(memory) == 2
    fmu.library.fmi2FreeFMUstate(ctypes.c_void_p(handle), ctypes.byref(state))
    fmu.library.fmi2FreeInstance(ctypes.c_void_p(handle))
    assert sorted(freed) == sorted(memory)


def test_what_is_no_instance_of_this_fmu_is_not_made(native, native_loaded):
    one, fmu = native("walker"), native_loaded("walker", "2.0")
    for name, kind, guid in ((b"x", 1, b"{wrong}"), (b"", 1, fmu.guid.encode()), (b"x", 0, fmu.guid.encode())):
        assert not fmu.library.fmi2Instantiate(name, kind, guid, None, ctypes.byref(one.callbacks), 0, 0)
    assert len(errors(one)) == 3


@both
def test_log_categories_can_be_chosen(native, version):
    one = native("walker", version).begin(sample_time=0.013)
    warning = (ctypes.c_char_p * 1)(b"logStatusWarning")
    flag = ctypes.c_int if version == "2.0" else ctypes.c_bool
    one.check("SetDebugLogging", flag(0), ctypes.c_size_t(1), warning)
    assert one.step(0.0, 0.01) == OK
    assert one.log == []
    unknown = (ctypes.c_char_p * 1)(b"logEverything")
    assert one.call("SetDebugLogging", flag(1), ctypes.c_size_t(1), unknown) == ERROR


def test_blocks_the_subset_cannot_express_are_refused_by_the_command(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("twip.fmi.build._chosen", lambda _: {"raising": face_of("raising")})
    assert main(["build", "--native", "--out", str(tmp_path)]) == 1
    (line,) = [s for s in capsys.readouterr().err.splitlines() if "raising.py" in s]
    assert re.search(r"raising\.py, line 18: time % step_size: // and % divide an integer", line)


def test_every_block_of_the_robot_is_native(native_path):
    assert {native_path(n, "2.0").stem for n in BLOCKS} == set(BLOCKS)
