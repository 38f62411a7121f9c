"""The reference uses the controller's face through the helper of the robot's tests."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "robot"))
