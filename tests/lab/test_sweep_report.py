"""The report of a sweep: the numbers of known results, that it escapes what it prints, and what it refuses."""

import json
import re

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from twip.cli import main

HOSTILE = "<script>alert(1)</script>"


def write(path, *, columns=None, **description):
    """Write the results of a sweep over two lists, in which the run of a = 2, b = 20 has failed."""
    axes = [
        {"label": name, "names": [name], "values": values, "distribution": None, "factor": False}
        for name, values in (("a", [1.0, 2.0]), ("b", [10.0, 20.0]))
    ]
    table = {
        "run": [0, 1, 2, 3],
        "a": [1.0, 1.0, 2.0, 2.0],
        "b": [10.0, 20.0, 10.0, 20.0],
        "seed": [5, 6, 7, 8],
        "verdict": ["pass", "pass", "fail", "error"],
        "error": [None, None, None, HOSTILE],
        "time": pa.array([0.5, 1.5, float("inf"), None], pa.float64()),
        **(columns or {}),
    }
    told = {
        **{"system": "s.ssp", "axes": axes, "design": None, "samples": 0, "seed": 42},
        "provenance": {"": {"component d": {"fmu": "d.fmu", "sha256": "0123456789abcdef"}}},
        **description,
    }
    metadata = {"twip": json.dumps({"sweep": told, "versions": {"python": "3.11.9"}, "runs": 4})}
    pq.write_table(pa.table(table).replace_schema_metadata(metadata), path)
    return path


def cells(text, label):
    """Return the cells of the row of a table."""
    row = re.search(rf"<th scope=row>{re.escape(label)}</th>(.*?)</tr>", text)
    return re.findall(r"<td>(.*?)</td>", row[1])


def payload(text):
    """Return what the page's script gets."""
    return json.loads(re.search(r'<script id="data" type="application/json">(.*?)</script>', text, re.DOTALL)[1])


def test_the_report_has_the_numbers_of_the_runs(tmp_path, capsys):
    path = write(tmp_path / "runs.parquet")
    assert main(["report", str(path)]) == 0
    assert str(tmp_path / "runs-sweep.html") in capsys.readouterr().out
    text = (tmp_path / "runs-sweep.html").read_text(encoding="utf-8")
    assert cells(text, "all runs") == ["2 of 4", "50.0%", "15.0% to 85.0%"]  # Wilson: (0.5 + z²/8 ± …) / (1 + z²/4)
    assert cells(text, "time") == ["0.5", "1.5", "∞", "3"]
    assert cells(text, "run 3") == ["a 2, b 20", "&lt;script&gt;alert(1)&lt;/script&gt;"]
    assert cells(text, "seed") == ["42"]
    assert cells(text, "python") == ["3.11.9"]
    assert cells(text, "component d") == ["d.fmu 0123456789ab"]
    assert HOSTILE not in text
    data = payload(text)
    (drawn,) = data["maps"]
    (panel,) = drawn["panels"]
    assert [panel["cells"][name] for name in ("x", "y", "shade")] == [
        ["1", "2", "1", "2"],
        ["10", "10", "20", "20"],
        [1.0, 0.0, 1.0, 0.0],
    ]
    assert "ranking needs 8" in text
    main(["report", str(path), "--out", str(tmp_path / "again.html")])
    assert (tmp_path / "again.html").read_text(encoding="utf-8") == text


def test_an_interrupted_sweep_is_called_so(tmp_path):
    path = write(tmp_path / "runs.parquet")
    assert main(["report", str(path)]) == 0
    assert "interrupted" not in (tmp_path / "runs-sweep.html").read_text(encoding="utf-8").partition("<script")[0]
    pq.write_table(pq.read_table(path).slice(0, 3), path)
    assert main(["report", str(path)]) == 0
    text = (tmp_path / "runs-sweep.html").read_text(encoding="utf-8")
    assert "1 run is missing: the sweep was interrupted" in text
    (drawn,) = json.loads(re.search(r'<script id="data" type="application/json">(.*?)</script>', text, re.DOTALL)[1])[
        "maps"
    ]
    cell = drawn["panels"][0]["cells"]
    assert (cell["shade"][3], cell["value"][3], cell["runs"][3]) == (None, "no runs", 0)


def test_each_parameter_set_has_its_rate_and_panel(tmp_path):
    path = write(tmp_path / "runs.parquet", columns={"parameters": ["x", "x", "y", "y"]})
    assert main(["report", str(path)]) == 0
    text = (tmp_path / "runs-sweep.html").read_text(encoding="utf-8")
    assert cells(text, "x")[:2] == ["2 of 2", "100.0%"]
    assert cells(text, "y")[:2] == ["0 of 2", "0.0%"]
    assert '"label":"x"' in text
    assert '"label":"y"' in text


@pytest.mark.parametrize(
    "options",
    [
        {"provenance": [3]},
        {"axes": [{"label": "a", "distribution": None, "factor": False}]},
        {"columns": {"time": ["x"] * 4}},
    ],
)
def test_a_foreign_file_gets_one_line(tmp_path, capsys, options):
    path = write(tmp_path / "runs.parquet", **options)
    assert main(["report", str(path)]) == 1
    assert capsys.readouterr().err.count("\n") == 1
    (tmp_path / "bad.parquet").write_bytes(b"PAR1 and then nothing")
    assert main(["report", str(tmp_path / "bad.parquet")]) == 1
    assert capsys.readouterr().err == f"twip: {tmp_path / 'bad.parquet'} is not the Parquet file of a sweep\n"


def test_values_that_look_alike_stay_apart(tmp_path):
    path = write(tmp_path / "runs.parquet", columns={"a": [1.0001, 1.0001, 1.0002, 1.0002]})
    assert main(["report", str(path)]) == 0
    assert '"across":["1.0001","1.0002"]' in (tmp_path / "runs-sweep.html").read_text(encoding="utf-8")


def test_logs_and_results_are_not_mixed(tmp_path, capsys):
    assert main(["report", str(tmp_path / "a.mcap"), str(tmp_path / "b.parquet")]) == 1
    assert "are reported alone" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
