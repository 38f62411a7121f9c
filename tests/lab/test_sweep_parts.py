"""What sweeps are made of: axes, designs, conditions, intervals, rankings, plan files, chosen runs."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from twip.cosim import Table
from twip.cosim.model.signals import Channel, Signal
from twip.errors import TwipError
from twip.lab.metrics import METRICS, REQUIRED
from twip.lab.sweep.axis import Axis, Distribution
from twip.lab.sweep.design import run_seed, unit_points
from twip.lab.sweep.keep import Keep
from twip.lab.sweep.measures import Condition, Judge
from twip.lab.sweep.parquet import Results
from twip.lab.sweep.plan import ParameterSet, Plan
from twip.lab.sweep.plan_file import read_plan
from twip.lab.sweep.statistics import Rate, rank_regression, sobol_indices
from twip.lab.sweep.worker import Row

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("1,2.5,-4", (1, 2.5, -4)),
        ("-0.5:0.5:3", (-0.5, 0.0, 0.5)),
        ("1:100:3:log", (1.0, 10.0, 100.0)),
        ("on,off", ("on", "off")),
        ("7", (7,)),
    ],
)
def test_values_of_an_axis(text, values):
    axis = Axis.parse("a.b", text)
    assert (axis.values, axis.names, axis.factor) == (
        pytest.approx(values) if values[0] != "on" else values,
        ("a.b",),
        False,
    )


def test_factors_and_several_names():
    axis = Axis.parse("friction", "x0.5:2:2", ["a.b", "c.d"])
    assert (axis.values, axis.names, axis.factor) == ((0.5, 2.0), ("a.b", "c.d"), True)
    assert Axis.parse("a.b", "xnormal(1, 0.1)").factor
    assert Axis.parse("a.b", "xenon,neon").values == ("xenon", "neon")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "a.b: there are no values"),
        ("1,,2", "a.b: '1,,2' has an empty value"),
        ("1:2:0", "a.b: '1:2:0': the grid must have at least one and at most 1000000 values"),
        ("1:2", "a.b: '1:2' must be FROM:TO:COUNT or FROM:TO:COUNT:log"),
        ("0:2:3:log", "a.b: '0:2:3:log': the ends of a logarithmic grid must be positive"),
        ("1,2,1", "a.b: a value is there twice"),
        ("norml(1)", "a.b: norml(1): scipy.stats has no distribution norml, did you mean norm?"),
        ("norm(1, x)", "a.b: norm(1, x): 'x' must be a number, or a name, = and a number, those last"),
        ("norm(1, -1)", "a.b: norm(1, -1): these arguments give no distribution"),
        ("__import__(1)", "a.b: __import__(1): scipy.stats has no distribution __import__"),
    ],
)
def test_bad_axes_get_one_line(text, message):
    with pytest.raises(TwipError) as caught:
        Axis.parse("a.b", text)
    assert str(caught.value) == message


def test_distributions_are_those_of_scipy():
    p = np.array([0.025, 0.5, 0.975])
    np.testing.assert_array_equal(Distribution("normal(2, scale=0.5)").quantiles(p), stats.norm(2, 0.5).ppf(p))
    assert Distribution("randint(1, 4)").quantiles(np.array([0.1, 0.5, 0.9])).tolist() == [1.0, 2.0, 3.0]


def test_designs_fill_the_cube_and_depend_on_the_seed_alone():
    for design in ("random", "lhs", "sobol"):
        points = unit_points(design, 64, 3, 5)
        assert points.shape == (64, 3)
        assert points.min() >= 0.0
        assert points.max() < 1.0
        np.testing.assert_array_equal(points, unit_points(design, 64, 3, 5))
        assert not np.array_equal(points, unit_points(design, 64, 3, 6))
        if design != "random":  # each of 64 intervals holds one point, on every axis
            assert (np.sort(np.floor(64 * points), axis=0) == np.arange(64)[:, None]).all()
    np.testing.assert_array_equal(unit_points("random", 8, 3, 5), unit_points("random", 64, 3, 5)[:8])
    np.testing.assert_array_equal(unit_points("sobol", 50, 3, 5), unit_points("sobol", 64, 3, 5)[:50])
    with pytest.raises(TwipError, match="samples = 50 must be a power of two for design indices, such as 64"):
        unit_points("indices", 50, 2, 1)


def test_seeds_of_runs_are_apart():
    seeds = [run_seed(1, k) for k in range(2000)]
    assert len(set(seeds)) == 2000
    assert all(0 <= s < 2**31 for s in seeds)
    assert not set(seeds) & {run_seed(2, k) for k in range(2000)}


@pytest.mark.parametrize(
    ("successes", "runs", "low", "high"),
    # R. G. Newcombe, Statistics in Medicine 17 (1998), table I, method 3
    [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0000, 0.1611), (1, 29, 0.0061, 0.1718)],
)
def test_wilson_intervals_are_the_published_ones(successes, runs, low, high):
    assert Rate(successes, runs).interval == pytest.approx((low, high), abs=5e-5)
    mirrored = Rate(runs - successes, runs).interval
    assert mirrored == pytest.approx((1 - high, 1 - low), abs=5e-5)


def results(columns, design="random", samples=0):
    axes = [{"label": n, "distribution": "uniform()", "factor": False} for n in columns if n in ("a", "b", "c")]
    count = len(next(iter(columns.values())))
    told = {"axes": axes, "design": design, "samples": samples}
    return Results({"run": list(range(count)), "verdict": ["done"] * count, **columns}, told, count)


def test_ranking_finds_what_matters():
    a, b, c = unit_points("lhs", 300, 3, 1).T
    found, explained = rank_regression(results({"a": a, "b": b, "c": c, "m": np.exp(3 * a - 6 * b)}), "m")
    assert [i.axis for i in found] == ["b", "a", "c"]
    assert found[0].value < -0.8
    assert 0.3 < found[1].value < 0.6
    assert found[2].low < 0.0 < found[2].high
    assert explained > 0.9  # a monotonic function of a sum
    alone, explained = rank_regression(results({"a": a, "m": -(a**3)}), "m")
    assert (alone[0].value, explained) == pytest.approx((-1.0, 1.0), abs=1e-12)


def test_ranking_refuses_what_tells_nothing():
    a = np.linspace(0, 1, 20)
    with pytest.raises(TwipError, match=r"m is 2 in every run: it depends on nothing"):
        rank_regression(results({"a": a, "m": [2.0] * 20}), "m")
    with pytest.raises(TwipError, match=r"m is known of 3 runs; ranking needs 8"):
        rank_regression(results({"a": a, "m": [1.0, 2.0, 3.0, *[None] * 17]}), "m")
    with pytest.raises(TwipError, match=r"the sweep has no column n; there are a, m, success"):
        rank_regression(results({"a": a, "m": a}), "n")


def test_sobol_indices_of_the_ishigami_function():
    n = 4096
    points = unit_points("indices", n, 3, 1)
    x = np.pi * (2 * points - 1)
    m = np.sin(x[:, 0]) + 7 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])
    columns = {"a": x[:, 0], "b": x[:, 1], "c": x[:, 2], "m": m}
    first, total = sobol_indices(results(columns, "indices", n), "m")
    # T. Ishigami, T. Homma (1990), closed form
    assert [i.value for i in first] == pytest.approx([0.3139, 0.4424, 0.0], abs=0.02)
    assert [i.value for i in total] == pytest.approx([0.5576, 0.4424, 0.2437], abs=0.02)
    assert all(i.low < i.value < i.high for i in total)
    with pytest.raises(TwipError, match="Sobol indices need a sweep of design indices"):
        sobol_indices(results(columns), "m")


def test_conditions():
    condition = Condition.parse("settling_time <= 2.5")
    assert (condition.metric, condition.comparison, condition.limit) == ("settling_time", "<=", 2.5)
    assert condition.met({"settling_time": 2.5})
    assert not condition.met({"settling_time": 2.6})
    assert not condition.met({"settling_time": None})
    with pytest.raises(TwipError, match="must be METRIC, one of < <= > >= == !=, and a number"):
        Condition.parse("x = 3")


def test_metrics_are_checked_together_before_anything_runs(tmp_path):
    (tmp_path / "mine.py").write_text("1 / 0", encoding="utf-8")
    with pytest.raises(TwipError) as caught:
        Judge(("max:a.x", "top:a.y", "robot", f"{tmp_path}/mine.py:f", "none.py:f"), ("x > y",), ["a.y"])
    assert str(caught.value).splitlines() == [
        "metric max:a.x: there is no signal a.x, did you mean a.y?",
        "unknown metric top:a.y: one of final, min, max, peak, mean, rms, a colon and a signal",
        "metric robot: the system has not the robot's signals",
        f"metric {tmp_path}/mine.py:f: {tmp_path}/mine.py cannot be run: ZeroDivisionError: division by zero",
        "metric none.py:f: none.py is no file",
        "condition 'x > y' must be METRIC, one of < <= > >= == !=, and a number",
    ]


PLAN = """
system = "robot.ssp"
stop_time = 5
design = "sobol"
samples = 16
repeat = 2
seed = 7
parameters = ["base.ssv"]
metrics = ["max:plant.x", "mine.py:top"]
success = ["top < 3"]
[start_values]
"plant.on" = true
[vary."plant.mass"]
grid = "1:3:3"
[vary.friction]
names = ["left.f", "right.f"]
factor = true
distribution = "uniform(0, 2)"
[parameter_sets]
plain = []
pid = ["sets/pid.ssv"]
"""


def test_a_plan_file_says_what_the_options_say(tmp_path):
    (tmp_path / "plan.toml").write_text(PLAN, encoding="utf-8")
    assert read_plan(tmp_path / "plan.toml") == Plan(
        tmp_path / "robot.ssp",
        (Axis.parse("plant.mass", "1:3:3"), Axis.parse("friction", "xuniform(0, 2)", ["left.f", "right.f"])),
        (ParameterSet("plain"), ParameterSet("pid", (tmp_path / "sets/pid.ssv",))),
        parameters=(tmp_path / "base.ssv",),
        start_values={"plant.on": True},
        design="sobol",
        samples=16,
        repeat=2,
        seed=7,
        metrics=("max:plant.x", f"{tmp_path}/mine.py:top"),
        success=("top < 3",),
        stop_time=5,
    )


def test_the_plans_of_the_documents_are_understood(tmp_path):
    page = (ROOT / "docs" / "sweep.md").read_text(encoding="utf-8")
    (example,) = re.findall(r"^```toml\n(.*?)^```$", page, re.DOTALL | re.MULTILINE)
    (tmp_path / "plan.toml").write_text(example, encoding="utf-8")
    plan = read_plan(tmp_path / "plan.toml")
    assert [axis.label for axis in plan.axes] == ["plant.body_mass", "friction"]
    plans = [read_plan(path) for path in sorted((ROOT / "docs" / "sweep").glob("*.toml"))]
    assert len(plans) == 4
    assert {s.label for plan in plans for s in plan.parameter_sets} == {"sliding mode", "without compensation", "PID"}
    assert all(file.is_file() for plan in plans for s in plan.parameter_sets for file in s.files)


def test_all_mistakes_of_a_plan_file_are_told_at_once(tmp_path):
    path = tmp_path / "plan.toml"
    text = """
stop_time = "5"
sample = 3
samples = 1.5
metrics = "x"
[start_values]
a = []
[vary.a]
[vary.b]
values = 3
[vary.c]
grid = "1:2:0"
[vary.d]
distribution = "norml(1)"
[vary.e]
values = [1]
step = 2
[parameter_sets]
x = "x.ssv"
"""
    path.write_text(text, encoding="utf-8")
    with pytest.raises(TwipError) as caught:
        read_plan(path)
    lines = [line.removeprefix(f"{path}: ") for line in str(caught.value).splitlines()]
    assert lines[0].startswith("unknown key sample; there are system, ")
    assert lines[1:] == [
        "samples must be a whole number",
        "stop_time must be a number of seconds",
        "metrics must be a list of texts",
        "there is no system",
        "start_values.a must be a number, true, false or a text",
        "vary.a: needs one of values, grid, distribution",
        "vary.b: values must be a list",
        "vary.c: '1:2:0': the grid must have at least one and at most 1000000 values",
        "vary.d: norml(1): scipy.stats has no distribution norml, did you mean norm?",
        "vary.e: unknown key step; there are names, values, grid, distribution, factor",
        "parameter_sets.x must be a list of files",
    ]
    path.write_text("system = ", encoding="utf-8")
    with pytest.raises(TwipError, match="is no TOML file"):
        read_plan(path)
    with pytest.raises(TwipError, match="cannot be read"):
        read_plan(Path("there/is/none.toml"))


def test_the_worst_runs_are_errors_then_failures_then_the_largest_metric():
    verdicts = ["pass", "fail", "error", "fail", "pass"]
    values = [5.0, 1.0, None, 2.0, None]
    rows = [
        Row(k, v, None, {} if v == "error" else {"m": x}) for k, (v, x) in enumerate(zip(verdicts, values, strict=True))
    ]
    assert Keep.parse("worst:5").chosen(rows) == [2, 3, 1, 0, 4]
    fallen = [
        *rows,
        Row(5, "fail", None, {"m": None}),
        Row(6, "done", None, {"m": None}),
        Row(7, "done", None, {"m": 1.0}),
    ]
    assert Keep.parse("worst:8").chosen(fallen) == [2, 5, 3, 1, 6, 0, 7, 4]  # what fell has no number and is worse
    assert Keep.parse("worst:2:m").chosen(rows) == [2, 3]
    assert Keep.parse("runs:4,0").chosen(rows) == [4, 0]
    with pytest.raises(TwipError, match="there is no run 9"):
        Keep.parse("runs:9").chosen(rows)
    with pytest.raises(TwipError, match="there is no metric n to tell the worst runs by; there are m"):
        replace(Keep.parse("worst:2"), metric="n").chosen(rows)
    for wrong in ("worst", "worst:0", "worst:x", "runs:", "runs:-1", "best:2"):
        with pytest.raises(TwipError, match="must be worst:COUNT"):
            Keep.parse(wrong)


def test_one_name_or_file_may_stand_alone():
    assert Axis("k", "a.k", (1.0, 2.0)) == Axis("k", ("a.k",), (1.0, 2.0))
    assert ParameterSet("pid", "pid.ssv").files == (Path("pid.ssv"),)
    plan = Plan(Path("s.ssp"), parameters="p.ssv", metrics="fallen", success="fallen == 0", seed_names="imu.seed")
    assert (plan.parameters, plan.metrics, plan.success) == ((Path("p.ssv"),), ("fallen",), ("fallen == 0",))
    assert plan.seed_names == ("imu.seed",)


def test_a_robot_without_estimator_is_judged_but_for_the_estimators_error():
    assert set(Judge((), (), REQUIRED).names) == {"fallen", *METRICS}
    with pytest.raises(TwipError, match=r"metric estimator_error: the system has no signal estimator\.pitch"):
        Judge(("estimator_error",), (), REQUIRED)


@pytest.mark.parametrize("asked", [("robot",), ("pitch_overshoot", "settling_time", "fallen", "energy")])
def test_a_sweep_has_no_number_of_a_fallen_robot_where_that_assumes_standing(asked):
    channels = [Channel("", tuple(Signal(name, "Real", None, "output") for name in (*REQUIRED, "estimator.pitch")))]
    table = Table(channels)
    times = np.linspace(0.0, 6.0, 601)
    rows = np.zeros((601, len(table.columns)))
    rows[times > 1.0, table.columns.index("plant.pitch_rate")] = -1.0
    rows[times >= 2.4, table.columns.index("plant.fallen")] = 1.0
    table.write(times, rows)
    judge = Judge(asked, ("fallen == 1",), table.columns)
    found = judge.metrics(table)
    untold = [name for name in found if found[name] is None]
    standing = ["steady_state_error", "peak_pitch_settled", "pitch_overshoot", "settling_time", "estimator_error"]
    assert untold == [name for name in standing if name in found]
    assert untold
    assert (found["fallen"], found["energy"], judge.verdict(found)) == (1.0, 0.0, "pass")
