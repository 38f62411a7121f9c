"""The table of types is that of fmpy, whose functions take the values."""

import ctypes

import pytest
from fmpy import fmi2, fmi3

from twip.cosim.values.types import ALL_NAMES, FMI2_TYPES, RECORDED_TYPES, TYPES, canonical, family, holds, limits


@pytest.mark.parametrize("name", RECORDED_TYPES)
def test_functions_take_a_type_as_fmpy_says(name):
    kind = TYPES[name]
    assert getattr(fmi3, f"fmi3{kind.fmi3}") is kind.fmi3_type
    assert getattr(fmi2, f"fmi2{name}", None) is kind.fmi2_type


@pytest.mark.parametrize("name", [name for name in TYPES if family(name) == "Integer"])
def test_an_integer_has_the_range_of_its_bits(name):
    kind = TYPES[name]
    bits = 8 * ctypes.sizeof(kind.fmi3_type)
    signed = kind.fmi3_type(-1).value < 0
    assert limits(name) == ((-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if signed else (0, 2**bits - 1))
    assert limits(kind.fmi3) == limits(name)


def test_names_of_both_versions_mean_one_type():
    assert set(FMI2_TYPES) == {"Real", "Integer", "Boolean", "String", "Enumeration"}
    assert {canonical(name) for name in ALL_NAMES} == set(TYPES)
    assert {name for name in ALL_NAMES if canonical(name) != name} == {"Float64", "Int32"}
    assert (family("Float64"), family("UInt16"), family("Clock")) == ("Real", "Integer", "Clock")


def test_a_type_holds_those_whose_values_it_has():
    held = {
        name: {other for other in TYPES if holds(name, other)} for name in ("Real", "Float32", "Int16", "Enumeration")
    }
    assert held == {
        "Real": {"Real", "Float32"},
        "Float32": {"Float32"},
        "Int16": {"Int8", "UInt8", "Int16"},
        "Enumeration": {"Enumeration"},
    }
