"""Start values and parameters that cannot be are told with their place and the rule."""

import pytest
from ssp_writer import bind, component, connection, edit_fmu, line_of, parameter_set, system, units, write

from twip.cosim import check, load

GAIN = "CosimGain.fmu"
TEXT = "a String of Unicode characters without NUL"


def test_values_outside_their_bounds_and_of_the_wrong_kind(folder):
    bounds = {"k": {"min": 0.001, "max": 5, "unit": "m"}}
    fmu = edit_fmu(folder / GAIN, folder / "g.fmu", variables=bounds, definitions="m m=1; s s=1").name
    (folder / "nominal.ssv").write_text(
        parameter_set(
            {"a.k": ("Real", -0.03), "b.k": ("Real", 7), "c.k": ("Boolean", "true"), "d.k": ("Real", 1, "s")},
            units("s s=1", "ssv"),
        )
    )
    path = write(folder, system([component(n, fmu) for n in "abcd"], inside=bind(source="nominal.ssv")))
    line = line_of(folder / "nominal.ssv", "-0.03")
    assert sorted(check(path)) == sorted([
        f"k = -0.03 m must be at least 0.001 m (component a, nominal.ssv line {line})",
        f"k = 7.0 m must be at most 5.0 m (component b, nominal.ssv line {line + 2})",
        f"k = 'true' must be a finite Real number, not Boolean (component c, nominal.ssv line {line + 4})",
        f"k = 1 [s] for a variable in m: units differ (component d, nominal.ssv line {line + 6})",
    ])  # fmt: skip


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"a.kk": 1}, "unknown parameter a.kk, did you mean a.k? (start values)"),
        ({"zzz.q": 1}, "unknown parameter zzz.q (start values)"),
        ({"a.k": "fast"}, "k = 'fast' must be a finite Real number (component a, start values)"),
        ({"a.k": "1_0"}, "k = '1_0' must be a finite Real number (component a, start values)"),
        ({"a.k": "\u0661"}, "k = '\u0661' must be a finite Real number (component a, start values)"),
        ({"a.k": float("nan")}, "k = 'nan' must be a finite Real number (component a, start values)"),
        ({"a.y": 1}, "y cannot be set: it is a continuous output (component a, start values)"),
        ({"m.n": 1.5}, "n = '1.5' must be an Integer of 32 bits (component m, start values)"),
        ({"m.n": 2**31}, "n = '2147483648' must be an Integer of 32 bits (component m, start values)"),
        ({"m.label": "a\0b"}, f"label = 'a\\x00b' must be {TEXT} (component m, start values)"),
        ({"m.label": "a\ud800b"}, f"label = 'a\\ud800b' must be {TEXT} (component m, start values)"),
        ({"m.on": "maybe"}, "on = 'maybe' must be a Boolean (true or false) (component m, start values)"),
    ],
)
def test_start_values_that_cannot_be(folder, values, message):
    path = write(folder, system([component("a", GAIN), component("m", "CosimMixed.fmu")]))
    assert check(path, start_values=values) == [message]


def test_the_caller_gives_no_start_value_to_what_is_connected(folder):
    inner = system([component("g", GAIN, "u> y<")], [connection("v -> g.u")], "v>:Real", name="inner")
    guess = bind({"u": ("Real", 1)})  # the description may give one, where initial values are sought
    path = write(
        folder,
        system(
            [component("a", GAIN, "u> y<"), component("b", GAIN, "u>", guess), inner],
            [connection("a.y -> b.u"), connection("a.y -> inner.v"), connection("x -> a.u")],
            "x>:Real",
        ),
    )
    (folder / "set.ssv").write_text(parameter_set({"b.u": ("Real", 5.5), "b.k": ("Real", 5)}))
    said = "is connected inside the system and cannot be given a start value"
    line = line_of(folder / "set.ssv", "5.5")
    assert check(path, start_values={"b.k": 1}) == []
    assert check(path, parameters=[folder / "set.ssv"]) == [f"b.u {said} (set.ssv line {line})"]
    for name in ("b.u", "inner.v", "inner.g.u"):
        assert check(path, start_values={name: 1}) == [f"{name} {said} (start values)"]
    # a connector of the system that has no value leaves the input behind it its own
    assert check(path, start_values={"a.u": 1}) == []
    assert check(path, start_values={"x": 1}) == []
    assert check(path, start_values={"a.u": 1, "x": 1}) == [f"a.u {said} (start values)"]


def test_bounds_of_integers_are_shown_as_integers(folder):
    fmu = edit_fmu(folder / "CosimMixed.fmu", folder / "few.fmu", variables={"n": {"min": 0, "max": 9}}).name
    path = write(folder, system([component("m", fmu)]))
    assert check(path, start_values={"m.n": -1}) == ["n = -1 must be at least 0 (component m, start values)"]
    assert check(path, start_values={"m.n": 10}) == ["n = 10 must be at most 9 (component m, start values)"]


def test_an_unknown_parameter_in_a_file(folder):
    path = write(folder, system([component("a", GAIN, "", bind({"kappa": ("Real", 1)}))]))
    assert check(path) == []  # the description may give values that nobody has
    with load(path) as loaded:
        assert loaded.warnings == (
            f"unknown parameter kappa is ignored (component a, SystemStructure.ssd line {line_of(path, 'ssv:Real')})",
        )
    (folder / "set.ssv").write_text(parameter_set({"a.kappa": ("Real", 1)}))
    assert check(path, parameters=[folder / "set.ssv"]) == [
        "unknown parameter a.kappa, did you mean a.k? (set.ssv line 3)"
    ]
    assert check(write(folder, system([component("a", GAIN)])), parameters=[folder / "no.ssv"]) == [
        f"{folder}/no.ssv: No such file or directory"
    ]
