"""Repeats the study of docs/sweep.md: where each controller stands.

From the project's root, after `twip build`:

    python docs/sweep/study.py            # results in logs/study, figures in docs/sweep

Sweeps that are there already are only drawn; delete logs/study to run them again.
"""

import time
from pathlib import Path

from twip.lab.sweep.parquet import Results
from twip.lab.sweep.pictures import draw_map, draw_rate, draw_sensitivity
from twip.lab.sweep.plan_file import read_plan
from twip.lab.sweep.run import run_sweep
from twip.lab.sweep.statistics import Rate

HERE = Path(__file__).parent
OUT = Path("logs") / "study"
MAPS = {
    "mass_height": (
        "plant.body_mass",
        "plant.cog_height",
        "Mass of the body [kg] and height of its centre of gravity [m]",
    ),
    "friction_sample_time": ("friction", "sample time", "Friction and sample time [s], stand-up from 10°"),
    "pitch_mass": ("plant.pitch_start", "plant.body_mass", "Pitch at the release [rad] and mass of the body [kg]"),
}


def results(name: str) -> Results:
    """Return the results of a plan, of runs that are done now if there are none; say what came out."""
    path = OUT / f"{name}.parquet"
    if not path.exists():
        begin = time.perf_counter()
        outcome = run_sweep(read_plan(HERE / f"{name}.toml"), path, resume=path.with_name(f"{path.name}.runs").exists())
        if outcome.interrupted:
            raise SystemExit(f"interrupted: {outcome.finished} of {outcome.runs} runs of {name} are kept")
        print(f"{name}: {outcome.done_now} runs in {time.perf_counter() - begin:.0f} s, {outcome.errors} errors")
    found = Results.read(path)
    for label in dict.fromkeys(found.columns["parameters"]):
        passed = [v for v, p in zip(found.columns["verdict"], found.columns["parameters"], strict=True) if p == label]
        rate = Rate(passed.count("pass"), len(passed))
        low, high = rate.interval
        print(f"  {label}: {rate.successes} of {rate.runs} stand, {rate.share:.0%} ({low:.0%} to {high:.0%})")
    return found


if __name__ == "__main__":
    for name, (x, y, title) in MAPS.items():
        draw_map(results(name), x, y, "success", HERE / f"{name}.png", title)
    found = results("all_five")
    draw_rate(found, found.axes[1:], HERE / "rates.png", "All five at once: how often each controller stands")
    for label in dict.fromkeys(found.columns["parameters"]):
        chosen = found.only(label)
        if len(set(chosen.columns["verdict"])) == 1:
            continue  # it depends on nothing
        picture = HERE / f"depends_{label.replace(' ', '_').lower()}.png"
        print(f"what standing depends on, {label}:")
        for line in draw_sensitivity(chosen, "success", picture, f"What standing depends on: {label}"):
            print(f"  {line}")
