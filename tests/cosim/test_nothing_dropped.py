"""Nothing in a file is passed over in silence: every place where the schemas allow what a tool may ignore is warned of,
every element and attribute of nobody's is refused, with the schemas and without.
"""

import pytest
from lxml import etree
from ssp_writer import (
    GAIN,
    bind,
    component,
    connection,
    dictionary,
    enumerations,
    line_of,
    linear,
    mapping,
    parameter_mapping,
    parameter_set,
    signals,
    system,
    units,
    write,
)  # fmt: skip

from twip.cosim import check, load
from twip.cosim.reading.xml import name_of
from twip.cosim.ssp import schemas

XS = "{http://www.w3.org/2001/XMLSchema}"
SSC = "http://ssp-standard.org/SSP1/SystemStructureCommon"
GRAPHICAL = {"ConnectorGeometry"}
OURS = "org.twip.cosim"
ADDED = {
    "MetaData": f'<ssc:MetaData xmlns:ssc="{SSC}" kind="general" type="text/plain" source="x"/>',
    "Signature": f'<ssc:Signature xmlns:ssc="{SSC}" role="authenticity" type="text/plain" source="x"/>',
}
WARNED = {
    "Annotations": "annotations of type test.other are ignored",
    "MetaData": "MetaData of {} is ignored",
    "Signature": "Signature of {} is ignored",
}


@pytest.fixture
def whole(folder):
    """Write a description with every element that is read and may hold something to ignore."""

    def make(version):
        entries = [("k", "k", linear(2.0, 1.0)), ("b", "b", mapping("Boolean", {"true": "false"}))]
        binding = bind({"k": ("Real", 1.0, "m"), "b": ("Boolean", "true")}, mapped=parameter_mapping(entries, version))
        more = enumerations("ssv", E={"x": 1}) + units("m m=1", "ssv")
        binding = binding.replace("</ssv:ParameterSet>", f"{more}</ssv:ParameterSet>").replace(
            '"1.0" name', f'"{version}" name'
        )
        book = dictionary(
            {"s": '<ssc:Real unit="m"/>'}, enumerations("ssb", F={"y": 2}) + units("m m=1", "ssb"), version
        )
        geometry = '<ssd:ConnectorGeometry x="0" y="0"/></ssd:Connector>'
        parts = [
            component("a", GAIN, "u> k* y<:Real[m]", binding).replace("</ssd:Connector>", geometry, 1),
            component("b", GAIN, "u>:Real[m] y<"),
            component("m", "CosimMixed.fmu", "n> total<"),
            component("o", "CosimMixed.fmu", "n>"),
            system([component("c", GAIN, "u>")], [connection("q -> c.u")], name="inner", ports="q>"),
            signals("ref", "book", "s~"),
        ]
        wires = [
            connection("a.y -> b.u", linear(1.0)),
            connection("m.total -> o.n", mapping("Integer", {1: 2})),
            connection("b.y -> ref.s"),
        ]
        tail = enumerations(M={"off": 0}) + units("m m=1") + '<ssd:DefaultExperiment stopTime="1"/>'
        return write(folder, system(parts, wires, dictionaries={"book": book}), tail=tail, version=version)

    return make


def places(version, wanted):
    """Return the names of the elements in which the schemas of a version allow the element."""
    found, types = set(), set()
    files = [schemas.schema_folder(version) / f"{name}.xsd" for name in schemas._ROOTS.values()]
    trees = [etree.parse(file) for file in [*files, files[0].with_name("SystemStructureCommon.xsd")]]
    every = [e for tree in trees for e in tree.iter(f"{XS}*")]
    for item in every:
        if item.get("name") == wanted or item.get("ref") == f"ssc:G{wanted}":
            above = [e for e in item.iterancestors(f"{XS}element", f"{XS}complexType", f"{XS}group") if e.get("name")]
            if above and above[0].get("name") != "MetaData":
                (found if above[0].tag == f"{XS}element" else types).add(above[0].get("name"))
    for item in every:
        if item.tag == f"{XS}extension" and item.get("base", "").rpartition(":")[2] in types:
            types.add(item.getparent().getparent().get("name"))
    return (found - {"G" + wanted}) | {e.get("name") for e in every if e.get("type", "").rpartition(":")[2] in types}


def variants(path):
    """Yield the name of each element that is read, and the same document with something more in it: a child `added`
    (before the child called `before`, else last) or an attribute.
    """
    data = path.read_bytes()
    count = len(list(etree.fromstring(data).iter("{*}*")))

    def changed(i, added="", attribute="", before=""):
        root = etree.fromstring(data)
        target = list(root.iter("{*}*"))[i]
        if added:
            position = next((n for n, c in enumerate(target) if name_of(c) == before), len(target))
            target.insert(position, etree.fromstring(added))
        if attribute:
            target.set(attribute, "1")
        path.write_bytes(etree.tostring(root))
        return path

    for i in range(count):
        element = list(etree.fromstring(data).iter("{*}*"))[i]
        if name_of(element) not in GRAPHICAL:
            yield element, lambda i=i, **more: changed(i, **more)


def annotated(element, kind):
    """Return an annotation that may stand in `element`."""
    namespace = etree.QName(element).namespace
    return (
        f'<x:Annotations xmlns:x="{namespace}" xmlns:ssc="{SSC}"><ssc:Annotation type="{kind}"><any/></ssc:Annotation>'
        "</x:Annotations>"
    )


@pytest.mark.parametrize(("version", "what"), [(1, "Annotations"), *((2, what) for what in WARNED)])
def test_what_a_tool_may_ignore_is_warned_of_wherever_the_schemas_allow_it(whole, version, what):
    path = whole(f"{version}.0")
    assert check(path) == []
    wanted, seen = places(version, what), set()
    assert {"System", "ParameterSet", "Component"} <= wanted
    for element, changed in variants(path):
        name = name_of(element)
        if name in wanted:
            added = ADDED.get(what) or annotated(element, "test.other")
            changed(added=added, before="" if what == "Annotations" else {"System": "Elements"}.get(name, ""))
            with load(path) as model:
                assert [
                    w for w in model.warnings if w.startswith(f"{WARNED[what].format(name)} (SystemStructure.ssd line ")
                ]
            seen.add(name)
    assert seen == wanted


@pytest.mark.parametrize(("version", "with_schemas"), [("1.0", True), ("2.0", True), ("2.0", False)])
def test_an_element_or_attribute_of_nobodys_is_refused_wherever_it_stands(whole, monkeypatch, version, with_schemas):
    path = whole(version)
    if not with_schemas:
        monkeypatch.setattr(schemas, "schema_folder", lambda _: None)
    assert check(path) == []
    for element, changed in variants(path):
        for more in ({"added": '<odd xmlns="urn:other"/>'}, {"attribute": "{urn:other}odd"}, {"attribute": "odd"}):
            lines = check(changed(**more))
            assert any("SystemStructure.ssd line" in line for line in lines), (name_of(element), more)


def test_what_may_stand_once_is_refused_twice(whole, monkeypatch):
    """The schemas say so too; without those of version 2 the readers do."""
    path = whole("2.0")
    monkeypatch.setattr(schemas, "schema_folder", lambda _: None)
    text = path.read_text()
    for once in (
        '<ssd:DefaultExperiment stopTime="1"/>', units("m m=1"), enumerations(M={"off": 0}), '<ssc:BaseUnit m="1"/>',
        '<ssc:Real unit="m"/>', linear(1.0), mapping("Boolean", {"true": "false"}),
    ):  # fmt: skip
        assert once in text
        path.write_text(text.replace(once, once + once, 1))
        assert check(path), once
    for name in (
        "ssd:Connectors",
        "ssd:ParameterBindings",
        "ssd:ParameterMapping",
        "ssd:ParameterValues",
        "ssd:Elements",
    ):
        begin = text.index(f"<{name}")
        part = text[begin : text.index(f"</{name}>") + len(name) + 3]
        path.write_text(text.replace(part, part + part, 1))
        assert check(path), name


def test_our_annotation_where_nobody_looks_for_it_is_refused(whole, folder):
    path = whole("1.0")
    for element, changed in variants(path):
        if name_of(element) in ("Unit", "Component", "ParameterSet", "MappingEntry"):
            changed(added=annotated(element, OURS))
            assert any(line.startswith(f"annotation {OURS} has no meaning here (") for line in check(path))
    text = parameter_set({"a.k": ("Real", 1.0)})
    (folder / "p.ssv").write_text(
        text.replace("</ssv:ParameterSet>", f"{annotated(etree.fromstring(text), OURS)}</ssv:ParameterSet>")
    )
    line = line_of(folder / "p.ssv", OURS)
    assert f"annotation {OURS} has no meaning here (p.ssv line {line})" in check(
        whole("1.0"), parameters=folder / "p.ssv"
    )
