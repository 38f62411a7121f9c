"""Lets the parts of the benchmark import what contestants share."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parent / "contestants"))
