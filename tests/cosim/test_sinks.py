"""Sinks that write files are found by the ending of the file."""

import pytest
from scenario_system import wired

from twip.cosim import RunDetails, Table, load, open_sink, read_log, simulate
from twip.cosim.sinks import file_sinks


@pytest.fixture
def results(fmus, tmp_path):
    """Run a system into files of the given names, and return their folder and the table of the run."""

    def written(*names):
        with load(wired(fmus, tmp_path), start_values={"a.u": 1.0}) as system:
            table, details = Table(system.channels), RunDetails(system.channels)
            sinks = [table, *(open_sink(tmp_path / name, details) for name in names)]
            simulate(system, step_size=0.125, stop_time=1.0, sinks=sinks)
        return tmp_path, table

    return written


def test_the_ending_chooses_the_sink(results):
    folder, table = results("out.csv", "out.mcap", "UPPER.MCAP")
    assert (folder / "out.csv").read_text().splitlines()[-1].startswith("1.0,")
    for name in ("out.mcap", "UPPER.MCAP"):
        assert read_log(folder / name)["a.x"].tolist() == table["a.x"].tolist()


def test_without_an_ending_of_a_sink_the_file_is_csv(results):
    folder, _ = results("out.csv", "out.dat", "out")
    for name in ("out.dat", "out"):
        assert (folder / name).read_bytes() == (folder / "out.csv").read_bytes()


def test_no_two_sinks_share_an_ending():
    sinks = set(file_sinks().values())
    assert len(sinks) >= 2
    assert len(file_sinks()) == sum(len(sink.endings) for sink in sinks)
