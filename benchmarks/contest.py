"""Runs masters against each other: each in a process of its own, in turns, on one processor."""

import os
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median, quantiles

HERE = Path(__file__).resolve().parent / "contestants"
TARGET = 0.15
"""Wall time of a run in s that steps are counted out for."""
FEWEST, MOST = 100, 10_000


@dataclass
class Contestant:
    """A master with its log on or off; `times` are in s per step, one for each run."""

    name: str
    words: tuple[str, ...]
    logging: bool
    python: str = sys.executable
    trouble: str = ""
    """Why it does not take part."""
    times: list[float] = field(default_factory=list)
    _process: subprocess.Popen[str] | None = None
    _steps: int = 1000

    def start(self, ssp: Path, unpacked: Path, logs: Path) -> None:
        """Start it and find out how many steps a run should have."""
        folder = logs / f"{self.words[0]}_{len(os.listdir(logs))}"
        folder.mkdir()
        system = [str(ssp), str(unpacked), str(folder) if self.logging else ""]
        environment = {**os.environ, "LD_LIBRARY_PATH": str(Path(self.python).parents[1] / "lib")}
        with (folder / "stderr").open("w") as errors:
            self._process = subprocess.Popen(
                [self.python, str(HERE / f"{self.words[0]}.py"), *system, *self.words[1:]],
                env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors, text=True,
            )  # fmt: skip
        if self._answer() != "ready":
            lines = (folder / "stderr").read_text(errors="replace").splitlines()
            missing = [line for line in lines if "ModuleNotFoundError" in line]
            self.trouble = "missing" if missing else f"failed: {(lines or [''])[-1][:120]}"
            return
        self._steps = FEWEST
        each = self.run()
        self._steps = max(FEWEST, min(MOST, round(TARGET / each / 100) * 100)) if each > 0.0 else FEWEST

    def run(self) -> float:
        """Run once and return the time per step in s."""
        assert self._process is not None
        assert self._process.stdin is not None
        self._process.stdin.write(f"{self._steps}\n")
        self._process.stdin.flush()
        answer = self._answer()
        try:
            return float(answer) / self._steps
        except ValueError:
            self.trouble = f"failed after it began: {answer[:120]}"
            return 0.0

    def stop(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()

    def _answer(self) -> str:
        assert self._process is not None
        assert self._process.stdout is not None
        for line in self._process.stdout:  # some masters print
            word = line.strip()
            if word == "ready" or _is_number(word):
                return word
        return ""

    @property
    def median(self) -> float:
        """Median time per step in s."""
        return median(self.times)

    @property
    def spread(self) -> tuple[float, float]:
        """First and last quartile in s."""
        first, _, last = quantiles(self.times, n=4)
        return first, last


def compete(contestants: list[Contestant], ssp: Path, unpacked: Path, logs: Path, repetitions: int) -> None:
    """Measure all, in turns; what cannot take part says why in `trouble`."""
    try:
        for contestant in contestants:
            contestant.start(ssp, unpacked, logs)
        for _ in range(repetitions):
            for contestant in contestants:
                if not contestant.trouble:
                    contestant.times.append(contestant.run())
    finally:
        for contestant in contestants:
            contestant.stop()


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
