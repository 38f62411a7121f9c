"""Replays a block's reference run through its FMU.

As a script, `python fmi_replay.py FMU FOLDER REFERENCE`, it unpacks the FMU into the folder first, with the marker of a
master that keeps it: where numba is installed the block then runs compiled.
"""

import csv
import struct
import sys
from pathlib import Path

from fmi_host import Fmu, Instance


def table(path):
    """Read a CSV file with a `time` column; return its header and its rows as floats."""
    with path.open(encoding="utf-8", newline="") as file:
        header, *rows = csv.reader(file)
    assert header[0] == "time"
    return header, [[float(x) for x in row] for row in rows]


def at(time, rows):
    """Return the row at a time: linear between rows, constant outside them, the last of several rows at one time."""
    before = [row for row in rows if row[0] <= time]
    after = [row for row in rows if row[0] > time]
    if not before or not after:
        return (before or after[:1])[-1]
    left, right = before[-1], after[0]
    share = (time - left[0]) / (right[0] - left[0])
    return [a + share * (b - a) for a, b in zip(left, right, strict=True)]


def replay(block, reference):
    """Run an instance over `input.csv` of the folder `reference`; return the header and bits of `output.csv` and found.

    The first row holds after initialization; before a step the inputs are set to what they are at its beginning. The
    numbers in the files are the shortest decimals that read back as the same float.
    """
    inputs, driven = table(reference / "input.csv")
    outputs, expected = table(reference / "output.csv")
    assert set(inputs[1:]) <= set(block.fmu.of("input"))
    assert set(outputs[1:]) == set(block.fmu.of("output"))
    size, found = block.fmu.step_size, []
    block.enter()
    for k in range(len(expected)):
        values = dict(zip(inputs, at(k * size, driven), strict=True))
        if k == 0:
            block.set(**{n.replace(".", "__"): x for n, x in values.items() if n != "time"})
            block.check("ExitInitializationMode")
        found.append([k * size, *(block.get(n) for n in outputs[1:])])
        block.set(**{n.replace(".", "__"): x for n, x in values.items() if n != "time"})
        assert block.step(k * size, size) == 0, block.log
    return outputs, bits(expected), bits(found)


def bits(rows):
    """Return the bits of rows of numbers."""
    return [struct.pack(f"{len(row)}d", *row) for row in rows]


def kept(folder):
    """Make a folder with the marker of a master that keeps it."""
    folder.mkdir()
    (folder / "twip-keeps-this-folder").touch()
    return folder


def main(fmu, folder, reference):
    block = Instance(Fmu(fmu, kept(Path(folder))))
    _, expected, found = replay(block, Path(reference))
    block.free()
    differing = [k for k, (a, b) in enumerate(zip(expected, found, strict=True)) if a != b]
    print(f"{len(found)} rows, {len(differing)} differ, numba {'' if 'numba' in sys.modules else 'not '}loaded")


if __name__ == "__main__":
    main(*sys.argv[1:])
