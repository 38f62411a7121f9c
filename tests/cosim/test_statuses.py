"""Every FMI status that a function may return, in this process and isolated: the rows before it, and one line."""

import pytest
from c_fmu import chain, demand
from flat_options import grouped

from twip.cosim import Table, load, simulate
from twip.errors import TwipError

RETURNED = {"discard": "discard", "error": "error", "fatal": "fatal", "pending": "pending", "strange": "-7"}
LOGGED = {
    "discard": ": status 2 on demand",
    "error": ": status 3 on demand",
    "fatal": ": status 4 on demand",
    "pending": ": status 5 on demand",
    "strange": "",
}
FUNCTIONS = {"set": "fmi2SetReal", "step": "fmi2DoStep", "get": "fmi2GetReal"}
IN_PROCESS = [(loop, where, what) for loop in ("compiled", "python") for where in FUNCTIONS for what in RETURNED]
ISOLATED = [("isolated", "step", what) for what in RETURNED] + [
    ("isolated", "set", "fatal"),
    ("isolated", "get", "error"),
]


def run(folder, where, what, at=0.0, way="python"):
    with load(chain(folder), start_values=demand(where, what, at)) as loaded:
        table, failure = Table(loaded.channels), ""
        options = {"isolate": True} if way == "isolated" else {"loop": way}
        try:
            simulate(loaded, sinks=[table], step_size=0.1, **grouped(coupling="gauss-seidel", **options))
        except TwipError as error:
            failure = str(error)
    assert table.closed
    return table, failure


@pytest.mark.parametrize(("way", "where", "what"), IN_PROCESS + ISOLATED)
def test_a_status_in_a_step_ends_the_run_after_the_rows_before(faulty_folder, way, where, what):
    table, failure = run(faulty_folder, where, what, 0.5, way)
    more = " (computed until t = 0.525 s)" if (where, what) == ("step", "discard") else ""
    assert failure == f"bad failed at t = 0.5 s: {FUNCTIONS[where]} returned {RETURNED[what]}{more}{LOGGED[what]}"
    rows = 5 if where == "get" else 6  # the outputs at 0.5 s belong to the step that ends there
    assert table.times.tolist() == [k * 0.1 for k in range(rows)]
    assert table["good.y"].tolist() == list(range(rows))
    assert table["bad.z"].tolist() == [2.0 * k for k in range(rows)]
    assert table.events[-1].text == failure


@pytest.mark.parametrize("way", ["compiled", "python", "isolated"])
def test_a_discarded_step_by_which_the_fmu_wants_to_end_ends_the_run(faulty_folder, way):
    """fmi2Discard, and fmi2Terminated is true."""
    with load(chain(faulty_folder), start_values=demand("step", "end", 0.5)) as loaded:
        table = Table(loaded.channels)
        options = {"isolate": True} if way == "isolated" else {"loop": way}
        result = simulate(loaded, sinks=[table], step_size=0.1, **grouped(coupling="gauss-seidel", **options))
    said = "bad asked to end the simulation, at t = 0.525 s, in the step from t = 0.5 s"
    assert (result.ended, result.time, result.steps) == (said, 0.5, 5)
    assert table.times.tolist() == [k * 0.1 for k in range(6)]
    assert table["bad.z"].tolist() == [2.0 * k for k in range(6)]
    assert [(e.level, e.text) for e in table.events] == [("info", said)]


@pytest.mark.parametrize(
    ("where", "function"), [("enter", "EnterInitializationMode"), ("exit", "ExitInitializationMode")]
)
@pytest.mark.parametrize(("way", "what"), [*(("python", what) for what in RETURNED), ("isolated", "fatal")])
def test_a_status_in_the_initialization_leaves_no_row(faulty_folder, way, where, function, what):
    table, failure = run(faulty_folder, where, what, way=way)
    assert failure == f"bad failed at t = 0 s: fmi2{function} returned {RETURNED[what]}{LOGGED[what]}"
    assert len(table.times) == 0


# from 0.3 s on: before the steps that begin at 0.3 to 0.9 s, in them, and at 0.3 to 1.0 s
WARNED = {"set": range(3, 10), "step": range(3, 10), "get": range(3, 11), "enter": [0], "exit": [0]}


@pytest.mark.parametrize(
    ("way", "where"), [*(("compiled", w) for w in WARNED), ("python", "step"), ("isolated", "step")]
)
def test_a_warning_goes_on(faulty_folder, way, where):
    table, failure = run(faulty_folder, where, "warning", 0.25 if where in FUNCTIONS else 0.0, way)
    assert failure == ""
    assert len(table.times) == 11
    warned = [e.time for e in table.events if (e.source, e.level, e.text) == ("bad", "warning", "status 1 on demand")]
    assert warned == [k * 0.1 for k in WARNED[where]]


@pytest.mark.parametrize(("way", "what"), [("compiled", "error"), ("compiled", "fatal"), ("isolated", "fatal")])
def test_a_status_at_the_end_is_a_warning(faulty_folder, way, what):
    table, failure = run(faulty_folder, "terminate", what, way=way)
    assert failure == ""
    assert len(table.times) == 11
    text = f"bad failed at t = 1 s: fmi2Terminate returned {what}{LOGGED[what]}"
    assert [(e.level, e.source, e.text) for e in table.events][-1] == ("warning", "", text)
