"""Which blocks the tests of this folder run on: the robot's and this folder's own."""

from pathlib import Path

from twip.fmi.blocks import block_folders

OWN = Path(__file__).parent / "blocks"
OWN_BLOCKS = ("raising", "typed", "walker")
BLOCKS = tuple(block_folders())


def face_of(name):
    """Return the Python file that declares a block."""
    return OWN / name / f"{name}.py" if (OWN / name).is_dir() else block_folders()[name] / f"{name}.py"
