"""Each block, run as plain Python over its reference input, gives its reference output to the last bit."""

import pytest
from plain import FMUS, instance, load, names, read, simulate

BLOCKS = sorted(path.parent.name for path in FMUS.glob("*/input.csv"))


@pytest.mark.parametrize("name", BLOCKS)
def test_reference_run(name: str) -> None:
    block = load(name).BLOCK
    inputs, expected = read(FMUS / name / "input.csv"), read(FMUS / name / "output.csv")
    assert list(inputs[0]) == ["time", *names(block, "input")]
    assert list(expected[0]) == ["time", *names(block, "output")]
    steps = round(inputs[-1]["time"] / block.step_size)
    rows = list(simulate(block, instance(block), inputs, block.step_size, steps))
    assert rows == expected


@pytest.mark.parametrize("name", BLOCKS)
def test_reference_files_are_small(name: str) -> None:
    assert max((FMUS / name / file).stat().st_size for file in ("input.csv", "output.csv")) < 200_000
