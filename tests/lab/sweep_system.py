"""A system of one small FMU for the tests of sweeps, and what its runs must give."""

import shutil
import subprocess
import sys
from math import exp
from pathlib import Path

HERE = Path(__file__).parent
BUILD = """
import sys
from pythonfmu.builder import FmuBuilder
FmuBuilder.build_FMU(sys.argv[1], dest=sys.argv[2])
"""
SSD = """<ssd:SystemStructureDescription xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"
    version="1.0" name="decay">
  <ssd:System name="decay"><ssd:Elements>
    <ssd:Component name="d" source="SweepDecay.fmu"/>
  </ssd:Elements></ssd:System>
  <ssd:DefaultExperiment startTime="0" stopTime="1"/>
</ssd:SystemStructureDescription>
"""
RATE = """<ssv:ParameterSet xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" version="1.0"
    name="rate"><ssv:Parameters>
  <ssv:Parameter name="d.rate"><ssv:Real value="{rate}"/></ssv:Parameter>
</ssv:Parameters></ssv:ParameterSet>
"""


def make_system(folder: Path) -> Path:
    """Build the FMU and write the system and a parameter set `rate3.ssv` beside it; return the system's path."""
    script = shutil.copy(HERE / "sweep_slaves" / "sweep_decay.py", folder)
    subprocess.run([sys.executable, "-c", BUILD, script, str(folder)], check=True, capture_output=True, timeout=60)
    path = folder / "decay.ssd"
    path.write_text(SSD, encoding="utf-8")
    (folder / "rate3.ssv").write_text(RATE.format(rate=3), encoding="utf-8")
    return path


def decayed(start: float, rate: float, time: float = 1.0) -> float:
    """The closed form."""
    return start * exp(-rate * time)
