"""docs/ssp.md says what the code does, and leaves out no element of the schemas."""

import re
from pathlib import Path

import pytest
from lxml import etree

from twip.cosim.reading.xml import ANNOTATION, IGNORED_WITH_WARNING
from twip.cosim.ssp.elements import GRAPHICAL, IMPLEMENTATIONS, KINDS
from twip.cosim.ssp.references import MAXIMUM_ELEMENTS, MAXIMUM_LEVELS
from twip.cosim.ssp.schemas import schema_folder
from twip.cosim.ssp.structure import DEFINITION, FMU, PACKAGE
from twip.cosim.ssp.type_elements import REFUSED
from twip.cosim.values.transformation import TRANSFORMATIONS
from twip.cosim.values.types import ALL_NAMES

TEXT = (Path(__file__).parents[2] / "docs" / "ssp.md").read_text(encoding="utf-8")
ROWS = [
    [re.findall(r"`([^`]+)`", cell) for cell in line.strip("|").split("|")] + [line]
    for line in TEXT.splitlines()
    if line.startswith("| `") or line.startswith("| URIs")
]
XS = "{http://www.w3.org/2001/XMLSchema}"


def row(first):
    """Return the row whose first cell begins with a word: words of each cell, and the line."""
    return next(r for r in ROWS if r[0] and r[0][0] == first)


@pytest.mark.parametrize("version", [1, 2])
def test_every_element_of_the_schemas_is_told_of(version):
    names = {
        element.get("name")
        for file in schema_folder(version).glob("*.xsd")
        for element in etree.parse(file).iter(f"{XS}element")
        if element.get("name") is not None
    }
    told = {name for r in ROWS for name in r[0]}
    assert len(names) > 40
    assert names - told == set()


@pytest.mark.parametrize("attribute", ["kind", "implementation"])
def test_every_value_of_an_attribute_is_told_of(attribute):
    described = etree.parse(schema_folder(2) / "SystemStructureDescription.xsd")
    values = {
        value.get("value")
        for found in described.iter(f"{XS}attribute")
        if found.get("name") == attribute
        for value in found.iter(f"{XS}enumeration")
    }
    applied, refused = row(attribute)[1:3]
    assert values == {*applied, *refused}
    assert set(applied) == set({"kind": KINDS, "implementation": IMPLEMENTATIONS}[attribute])


def test_the_table_is_that_of_the_code():
    assert set(row("Real")[0]) == ALL_NAMES
    assert set(row("Binary")[0]) == set(REFUSED)
    assert set(row("LinearTransformation")[0]) == {*TRANSFORMATIONS, "MapEntry"}
    assert set(row("ElementGeometry")[0]) == {*GRAPHICAL, "ConnectionGeometry", "Note"}
    assert set(row("MetaData")[0]) == {*IGNORED_WITH_WARNING, "Content"}
    assert set(row("type")[1]) == {FMU, DEFINITION, PACKAGE}
    assert row("Annotations")[1] == [ANNOTATION]
    assert f"{MAXIMUM_ELEMENTS:,}".replace(",", " ") in TEXT
    assert f"{MAXIMUM_LEVELS} levels" in TEXT
