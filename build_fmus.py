"""Builds fmus/*.fmu and ssp/*.ssp in place; the options are those of `twip build`.

python build_fmus.py
python build_fmus.py plant imu
python build_fmus.py --fmi 3
python build_fmus.py --native
"""

import sys
from pathlib import Path

from twip.cli import main

if __name__ == "__main__":
    sys.exit(main(["build", "--out", str(Path(__file__).parent), *sys.argv[1:]]))
