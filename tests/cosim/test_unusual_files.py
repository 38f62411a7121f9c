"""Files as other tools and hands make them: what is odd in them is done, warned of or refused, never dropped."""

import re
import zipfile

import pytest
from echo_fmu import compiled, echo3
from ssp_writer import (
    GAIN,
    a_and_b,
    bind,
    component,
    connection,
    dictionary,
    line_of,
    parameter_set,
    system,
    write,
)

from twip.cosim import check, load, simulate
from twip.cosim.ssp import schemas
from twip.errors import TwipError


def changed_fmu(folder, *edits):
    """Write a system of one FMU whose model description is edited by pairs of old and new text."""
    with zipfile.ZipFile(folder / GAIN) as archive:
        contents = {name: archive.read(name) for name in archive.namelist()}
    text = contents["modelDescription.xml"].decode()
    for old, new in edits:
        assert old in text
        text = text.replace(old, new, 1)
    with zipfile.ZipFile(folder / "x.fmu", "w") as archive:
        for name, data in {**contents, "modelDescription.xml": text.encode()}.items():
            archive.writestr(name, data)
    return write(folder, system([component("a", "x.fmu", "u> y<")]))


def test_other_encodings_line_ends_and_comments_make_no_difference(folder):
    path = write(folder, a_and_b(connection("a.y -> b.u")))
    text = path.read_text()
    path.write_bytes(text.replace("\n", "\r\n<!-- remark -->").encode("utf-16"))
    with load(path) as model:
        assert simulate(model, step_size=0.25)["b.y"][-1] == 2.0


def test_an_archive_of_a_folder_is_recognized(folder):
    path = write(folder, a_and_b())
    with zipfile.ZipFile(folder / "x.ssp", "w") as archive:
        archive.write(path, "x/SystemStructure.ssd")
    assert check(folder / "x.ssp") == [
        f"{folder}/x.ssp: the archive holds no SystemStructure.ssd, only x/SystemStructure.ssd:"
        " what is in that folder belongs directly into it"
    ]


@pytest.mark.parametrize(("name", "type_"), [("i.ssd", "definition"), ("i.ssp", "package"), ("I.SSD", "definition")])
def test_a_system_that_is_called_an_fmu_is_refused(folder, name, type_):
    (folder / name).write_text("")
    path = write(folder, system([component("a", name)]))
    said = f"component a: {name} is a system: its type must be application/x-ssp-{type_}"
    assert check(path) == [f"{said} (SystemStructure.ssd line {line_of(path, name)})"]


def test_a_fragment_of_a_parameter_file_is_refused(folder):
    (folder / "p.ssv").write_text(parameter_set({"a.k": ("Real", 3)}))
    assert check(write(folder, a_and_b(inside=bind(source="p.ssv#half")))) == [
        "source p.ssv#half: a fragment has no meaning here (SystemStructure.ssd line 2)"
    ]


def test_a_unit_without_definition_is_warned_of_in_a_parameter_set(folder):
    with load(write(folder, a_and_b(inside=bind({"a.k": ("Real", 3, "furlong")})))) as model:
        assert [w.partition(" (")[0] for w in model.warnings] == [
            "unit furlong has no definition in the file",
            "a variable without unit takes the value as it is: a.k [furlong]",
        ]


def test_a_dictionary_that_nothing_refers_to_is_read_too(folder):
    path = write(folder, system([component("a", GAIN)], dictionaries={"book": "none.ssb"}))
    assert check(path) == [
        f"none.ssb: No such file or directory (SystemStructure.ssd line {line_of(path, 'none.ssb')})"
    ]
    path = write(folder, system([component("a", GAIN)], dictionaries={"book": dictionary({"s": "<ssc:Binary/>"})}))
    assert "type Binary is not supported" in check(path)[0]


@pytest.mark.parametrize("with_schemas", [True, False])
def test_elements_without_the_namespace_are_not_taken_for_those_of_ssp(folder, monkeypatch, with_schemas):
    if not with_schemas:
        monkeypatch.setattr(schemas, "schema_folder", lambda _: None)
    path = write(folder, a_and_b(), version="2.0")
    path.write_text(re.sub(r"(</?)ss[dc]:", r"\1", path.read_text()))
    assert check(path) == [
        "expected a SystemStructureDescription, found SystemStructureDescription without a namespace"
        " (SystemStructure.ssd line 1)"
    ]
    path = write(folder, a_and_b(), version="2.0")
    path.write_text(re.sub(r"(</?)ssd:(Elements|Connector)\b", r"\1\2", path.read_text()))
    assert len(check(path)) >= 1


def test_bounds_of_an_fmu_that_exclude_its_start_value_or_everything(folder):
    path = changed_fmu(folder, ('<Real start="0.5"', '<Real min="3" max="4" start="0.5"'))
    with load(path) as model:
        assert list(model.warnings) == ["start value u = 0.5 must be at least 3.0 (x.fmu: modelDescription.xml)"]
    path = changed_fmu(folder, ('<Real start="0.5"', '<Real min="4" max="3" start="0.5"'))
    assert check(path) == ["variable u: min = 4.0 is above max = 3.0 (x.fmu: modelDescription.xml)"]


def test_a_model_variable_that_is_none_is_refused(folder):
    path = changed_fmu(folder, ("<ModelVariables>", '<ModelVariables><Real name="q"/>'))
    assert check(path)[0].startswith("Real in ModelVariables is no ScalarVariable (x.fmu: modelDescription.xml line ")


@pytest.mark.parametrize("values", [{5: 1.0}, [("a.k", 1.0)]])
def test_values_that_are_not_by_name_are_refused(folder, values):
    with pytest.raises(TwipError, match=r"^start_values = .* must be a mapping"):
        check(write(folder, a_and_b()), start_values=values)


@pytest.mark.parametrize(
    ("values", "sizes", "said"),
    [
        ("1 2", [2], "ins_Float64 is 2, but a.ins_Float64 is 3"),
        ("1 2 3 4", [4], "ins_Float64 is 4, but a.ins_Float64 is 3"),
        ("1 2 3", [1, 3], "ins_Float64 is 1 x 3, but a.ins_Float64 is 3"),
        ("1", [], "ins_Float64 is a scalar, but a.ins_Float64 is 3"),
        ("1 2 3", [3], ""),
    ],
)
def test_an_array_parameter_has_the_shape_of_its_variable(tmp_path, values, sizes, said):
    echo3(tmp_path, compiled("echo3", tmp_path))
    inner = bind({"ins_Float64": ("Real", values)}).replace('"1.0" name', '"2.0" name')
    dimensions = "".join(f'<ssc:Dimension size="{size}"/>' for size in sizes)
    inner = inner.replace("</ssv:Parameter>", f"{dimensions}</ssv:Parameter>")
    path = write(tmp_path, system([component("a", "echo3.fmu", inside=inner)]), version="2.0")
    place = f" (SystemStructure.ssd line {line_of(path, 'ssv:Real')})"
    assert check(path) == ([f"parameter {said}{place}"] if said else [])


def test_an_unpacked_fmu_is_called_one_where_a_system_is_wanted(tmp_path):
    (tmp_path / "modelDescription.xml").write_text("<fmiModelDescription/>")
    with pytest.raises(TwipError, match="is an FMU; a system is"):
        load(tmp_path)
