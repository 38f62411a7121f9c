"""Scenario files with mistakes: every one told with its place, all together, before anything runs."""

import random

import pytest
from scenario_system import EVERYTHING, STEP, fault, run, wired

from twip.cosim import Checkpoints, Inputs, load, simulate
from twip.errors import TwipError


@pytest.fixture
def path(fmus, tmp_path):
    return wired(fmus, tmp_path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a = ", "not readable as TOML: Invalid value (s.toml line 1)"),
        ("a = 1\n", "unknown key a: there are description, faults, input_file, inputs, parameters (s.toml line 1)"),
        ("[fault]\n", "unknown key fault, did you mean faults?"),
        ("[faults]\n", "faults must be tables, each headed [[faults]] (s.toml)"),
        ("input_file = 3\n", "input_file = 3 must be the path of a CSV file (s.toml line 1)"),
        ('[inputs]\n"a.w" = [[0, 1]]\n', "there is no input a.w, did you mean a.u? (s.toml line 2)"),
        ('[inputs]\n\n"g.u" = [[0, 1]]\n', "g.u is connected inside the system and cannot be driven (s.toml line 3)"),
        ('[inputs]\n"a.u" = [0, 1]\n', "inputs.a.u must be a list of pairs [time in s, value] (s.toml line 2)"),
        ('[inputs]\n"a.u" = [[0, "x"]]\n', "inputs.a.u[0] = 'x' must be a finite number (s.toml line 2)"),
        ('[inputs]\n"a.u" = [[0, true]]\n', "inputs.a.u[0] = true must be a finite number (s.toml line 2)"),
        ('[inputs]\n"a.u" = [[nan, 1]]\n', "inputs.a.u[0]: time nan must be a finite number (s.toml line 2)"),
        ('[inputs]\n"m.on" = [[0, 2]]\n', "inputs.m.on[0] = 2 must be true, false, 1 or 0 (s.toml line 2)"),
        (
            '[inputs]\n"a.u" = [[1, 1], [0.5, 1]]\n',
            "inputs.a.u[1]: time 0.5 follows 1.0: time must increase (s.toml line 2)",
        ),
        (fault("bias"), "faults[0] has no value (s.toml line 1)"),
        (
            fault("bios", value=1),
            "faults[0].kind = 'bios' must be one of stuck, bias, noise, dropout, delay (s.toml line 3)",
        ),
        (
            fault("bias", value=1) + fault("bias", value="'1'"),
            "faults[1].value = '1' must be a finite number (s.toml line 8)",
        ),
        (fault("bias", "g.w", value=1), "faults[0]: there is no signal g.w, did you mean g.y? (s.toml line 2)"),
        (fault("bias", "m.smooth", value=1), "faults[0]: m.smooth is not connected (s.toml line 2)"),
        (fault("bias", "g.z", value=1), "faults[0]: g.z is not connected (s.toml line 2)"),
        (
            fault("bias", "out", value=1),
            "faults[0]: out is a connector: name the output or the input behind it (s.toml line 2)",
        ),
        (fault("bias", "n.n", value=1), "faults[0]: bias needs a Real signal, not Integer (s.toml line 4)"),
        (fault("stuck", "n.n", value=1.5), "faults[0].value = 1.5 must be an Integer of 32 bits (s.toml line 4)"),
        (fault("noise", deviation=-1), "faults[0].deviation = -1 must be a positive number (s.toml line 4)"),
        (
            fault("dropout", probability=2),
            "faults[0].probability = 2 must be a probability above 0, at most 1 (s.toml line 4)",
        ),
        (fault("dropout", seed=0.5), "faults[0].seed = 0.5 must be a whole number (s.toml line 4)"),
        (
            fault("stuck", seed=1),
            "unknown key faults[0].seed: there are kind, signal, start, stop, value (s.toml line 4)",
        ),
        (
            fault("delay", delay=0.3),
            "faults[0].delay = 0.3 s must be a whole multiple of the step, 0.125 s (s.toml line 4)",
        ),
        (fault("delay", delay=1e300), "faults[0].delay = 1e+300 s is more than 10000000 steps (s.toml line 4)"),
        (fault("stuck", start=2, stop=1), "faults[0].stop = 1 s must be later than the start, 2 s (s.toml line 4)"),
        (fault("stuck", start=-1), "faults[0].start = -1 s is before the start time, 0 s (s.toml line 4)"),
        (fault("stuck", start='"now"'), "faults[0].start = 'now' must be a time in s (s.toml line 4)"),
        (
            fault("stuck", start=1.01, stop=1.02),
            "faults[0] begins and ends between two communication points, it would do nothing (s.toml line 4)",
        ),
        ('[[parameters]]\nname = "g.k"\nvalue = 1\n', "parameters[0] has no time (s.toml line 1)"),
        (
            '[[parameters]]\ntime = 1\nname = "g.K"\nvalue = 1\n',
            "parameters[0]: unknown parameter g.K, did you mean g.k? (s.toml line 3)",
        ),
        (
            '[[parameters]]\ntime = 1\nname = "a.x_start"\nvalue = 1\n',
            "parameters[0]: a.x_start cannot change during a run: it is a fixed parameter, no tunable one"
            " (s.toml line 3)",
        ),
        (
            '[[parameters]]\ntime = 1\nname = "g.k"\nvalue = "1"\n',
            "parameters[0]: g.k = '1' must be a finite Real number (s.toml line 4)",
        ),
        (
            '[[parameters]]\ntime = 1\nname = "m.label"\nvalue = "a\\u0000b"\n',
            "parameters[0]: m.label = 'a\\x00b' must be a String of Unicode characters without NUL (s.toml line 4)",
        ),
        (
            '[[parameters]]\ntime = 1\nname = "g.k"\nvalue = 99\n',
            "parameters[0]: k = 99.0 must be at most 9.0 (s.toml line 4)",
        ),
    ],
)
def test_mistakes_are_named_with_their_place(path, text, message):
    with pytest.raises(TwipError) as failure:
        run(path, text)
    assert str(failure.value) == message or str(failure.value).startswith(f"{message} (")


def test_all_mistakes_are_told_together_before_anything_runs(path):
    (path.parent / "in.csv").write_text("time,m.n\n0,x\n")
    text = 'input_file = "in.csv"\n' + fault("bias", "a.y", value=1) + fault("delay", delay=0)
    with pytest.raises(TwipError) as failure:
        run(path, text)
    assert str(failure.value).splitlines() == [
        "m.n = 'x' must be an Integer of 32 bits (in.csv line 2)",
        "faults[0]: there is no signal a.y, did you mean g.y? (s.toml line 3)",
        "faults[1].delay = 0 must be a positive number (s.toml line 9)",
    ]


def test_two_time_series_for_one_input_are_refused(path):
    (path.parent / "in.csv").write_text("time,a.u\n0,1\n")
    with pytest.raises(TwipError, match=r"a.u has two time series \(s.toml line 2\)"):
        run(path, '[inputs]\n"a.u" = [[0, 1]]\n', input_file=path.parent / "in.csv")


def test_mutated_files_end_without_a_traceback(path):
    (path.parent / "in.csv").write_text("time,m.held\n0,1\n1,2\n")
    text = 'input_file = "in.csv"\n[inputs]\n"a.u" = [[0, 1.0], [1, 2]]\n' + EVERYTHING
    chance, pieces = (
        random.Random(1),
        ['"', "[", "]", "=", "-", "1e999", "nan", "true", "{}", "\n", "\0", "é", "[[faults]]"],
    )
    with load(path) as loaded:
        refused = 0
        for _ in range(1000):
            at = chance.randrange(len(text))
            mutated = text[:at] + chance.choice(pieces) + text[at + chance.randrange(4) :]
            (path.parent / "s.toml").write_text(mutated, encoding="utf-8")
            try:
                simulate(
                    loaded,
                    step_size=STEP,
                    stop_time=4.0,
                    inputs=Inputs(scenario=path.parent / "s.toml"),
                    checkpoints=Checkpoints(every=1.0),
                )
            except TwipError as failure:  # without a file for the checkpoint no mutant is run
                refused += "a checkpoint interval needs a file" not in str(failure)
    assert refused > 500
