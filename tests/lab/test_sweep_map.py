"""Maps of a sweep: what passes, what fails and what was not run cannot be taken for each other; axes have units."""

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from twip.cosim import load
from twip.lab.sweep.axis import Axis
from twip.lab.sweep.parquet import Results
from twip.lab.sweep.pictures import BETWEEN, FAILS, PASSES, draw_map, draw_rate
from twip.lab.sweep.plan import Plan

DEUTAN = np.array([[0.367, 0.861, -0.228], [0.280, 0.673, 0.047], [-0.012, 0.043, 0.969]])
"""Linear RGB as a deuteranope sees it (G. M. Machado et al., IEEE Trans. Vis. Comput. Graph. 15, 2009)."""


def results(runs, **told):
    """Return the results of runs given as (mass, height, verdict, time)."""
    axes = [
        {"label": name, "names": [name], "values": [1.0, 2.0], "distribution": None, "factor": name == "height"}
        for name in ("mass", "height")
    ]
    names = ("mass", "height", "verdict", "time")
    columns = {"run": list(range(len(runs))), **dict(zip(names, map(list, zip(*runs, strict=True)), strict=True))}
    description = {"axes": axes, "design": None, "samples": 0, "units": {"mass": "kg", "time": "s"}, **told}
    return Results(columns, description, len(runs))


WHOLE = [(1.0, 1.0, "pass", 1.0), (1.0, 2.0, "pass", 2.0), (2.0, 1.0, "fail", 3.0), (2.0, 2.0, "pass", 4.0)]


def lightness(colour, sees):
    """Return a colour's lightness L* (CIE 1976) and its linear RGB, as seen."""
    encoded = np.array(to_rgb(colour))
    linear = sees @ np.where(encoded > 0.04045, ((encoded + 0.055) / 1.055) ** 2.4, encoded / 12.92)
    return 116.0 * np.cbrt(linear @ (0.2126, 0.7152, 0.0722)) - 16.0, linear


@pytest.mark.parametrize("sees", [np.eye(3), DEUTAN], ids=["all colours", "no green"])
def test_passes_fails_and_the_empty_ground_are_far_apart(sees):
    colours = {name: lightness(colour, sees) for name, colour in (("pass", PASSES), ("fail", FAILS), ("no", "white"))}
    for one, other in (("pass", "no"), ("fail", "no"), ("pass", "fail")):
        light, distance = np.subtract(colours[one][0], colours[other][0]), colours[one][1] - colours[other][1]
        # twenty steps of lightness, or half the way from black to a primary colour
        assert abs(light) > 20.0 or np.linalg.norm(distance) > 0.5, (one, other)
    assert lightness(BETWEEN, sees)[0] > colours["pass"][0]


def test_cells_without_run_are_hatched_and_explained(tmp_path):
    draw_map(results(WHOLE[:3]), "mass", "height", "success", tmp_path / "map.svg")
    text = (tmp_path / "map.svg").read_text(encoding="utf-8")
    assert "no run<" in text
    assert "no finite number<" not in text
    assert PASSES in text
    assert FAILS in text
    assert "mass [kg]<" in text
    assert "height, multiples of its value<" in text


def test_cells_without_a_finite_number_are_another_matter(tmp_path):
    runs = [*WHOLE[:2], (2.0, 1.0, "fail", float("inf"))]
    draw_map(results(runs), "mass", "height", "time", tmp_path / "map.svg")
    text = (tmp_path / "map.svg").read_text(encoding="utf-8")
    assert "no run<" in text
    assert "no finite number<" in text
    assert "time [s]<" in text


def test_a_full_map_needs_no_explanation(tmp_path):
    draw_map(results(WHOLE), "mass", "height", "success", tmp_path / "map.svg")
    text = (tmp_path / "map.svg").read_text(encoding="utf-8")
    assert "no run<" not in text
    assert ">1<" in text  # ticks are the values
    assert ">2<" in text


def test_a_file_without_units_is_drawn_without_them(tmp_path):
    draw_rate(results(WHOLE, units={}), ["mass"], tmp_path / "rate.svg")
    text = (tmp_path / "rate.svg").read_text(encoding="utf-8")
    assert ">mass<" in text
    assert "share that passes, 95% interval<" in text


def test_units_are_those_of_the_systems_variables(built):
    axes = (
        Axis.parse("plant.body_mass", "1,2"),
        Axis.parse("plant.cog_height", "x1,2"),
        Axis.parse("both", "1,2", ["left.coulomb_forward", "plant.body_mass"]),
        Axis.parse("friction", "0,1", ["left.coulomb_forward", "right.coulomb_forward"]),
    )
    path = built / "ssp" / "twip.ssp"
    with load(path) as system:
        found = Plan(path, axes, metrics=("settling_time", "max:plant.x", "own.py:mine")).units(system)
    assert {name: found.get(name) for name in ("plant.body_mass", "friction", "settling_time", "max:plant.x")} == {
        "plant.body_mass": "kg", "friction": "N.m", "settling_time": "s", "max:plant.x": "m"
    }  # fmt: skip
    assert not {"plant.cog_height", "both", "own.py:mine", "balanced"} & found.keys()
