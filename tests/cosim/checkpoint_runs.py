"""Runs that are saved: an oscillator with all types, and how to run it."""

from flat_options import grouped
from ssp_writer import bind, component, connection, edit_fmu, linear, system, write

from twip.cosim import Table, load, simulate

STEP = 1 / 128
INPUTS = "time,m.smooth,m.held,m.n,m.on\n0,0.1,1,4,1\n0.6,-0.3,2,-5,0\n1.2,0.2,3,9,1\n"


def prepare(fmus, folder):
    """Put the FMUs into a folder, able to serialize their state and with the dependencies they have, and `in.csv`."""
    depends = {"CosimGain": {"y": ["u"], "z": ["u"]}, "CosimIntegrator": {"x": []}}
    for fmu in fmus.glob("*.fmu"):
        edit_fmu(fmu, folder / fmu.name, dependencies=depends.get(fmu.stem), state=True)
    (folder / "in.csv").write_text(INPUTS)
    return folder


def describe(folder, *, factor=-1.0, start=1.0, gain="CosimGain.fmu"):
    """An oscillator that drives, and is driven by, a component with Integers and Booleans."""
    parts = [
        component("a", "CosimIntegrator.fmu", "u> x<"),
        component("b", "CosimIntegrator.fmu", "u> x<", bind({"x_start": ("Real", start)})),
        component("g", gain, "u> y<"),
        component("m", "CosimMixed.fmu", "total<:Integer seen<"),
    ]
    wires = [
        connection("a.x -> g.u", linear(factor=factor)),
        connection("g.y -> b.u", linear(factor=0.5)),
        connection("b.x -> a.u"),
    ]
    return write(folder, system(parts, wires))


def run(path, **options):
    """Run with everything that a step may remember: mid-step inputs, driven inputs."""
    given = {"step_size": STEP, "coupling": "gauss-seidel", "mid_step": ["a.u", "b.u"], "loop": "python", **options}
    given.setdefault("input_file", path.parent / "in.csv")
    with load(path) as loaded:
        table = Table(loaded.channels)
        result = simulate(loaded, sinks=[table], **grouped(**given))
    return table, result
