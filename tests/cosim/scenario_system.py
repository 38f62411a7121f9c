"""The system that scenarios are tried on, and how they are run.

`a.x` is a ramp, x = t; `g.u` takes it, `h.u` takes it times 2. By Gauss–Seidel a row at t shows what they took of x(t).
"""

from flat_options import grouped
from ssp_writer import component, connection, edit_fmu, linear, system, write

from twip.cosim import Table, load, simulate

STEP = 1 / 8
DEPENDS = {"CosimGain": {"y": ["u"], "z": ["u"]}, "CosimIntegrator": {"x": []}}


def wired(fmus, tmp_path):
    """Write the system with copies of the FMUs, and return its path."""
    for fmu in fmus.glob("*.fmu"):
        variables = {"k": {"variability": "tunable", "min": -9, "max": 9}} if fmu.stem == "CosimGain" else {}
        edit_fmu(fmu, tmp_path / fmu.name, dependencies=DEPENDS.get(fmu.stem), state=True, variables=variables)
    parts = [
        component("a", "CosimIntegrator.fmu", "u> x<"),
        component("g", "CosimGain.fmu", "u> y<"),
        component("h", "CosimGain.fmu", "u> y<"),
        component("m", "CosimMixed.fmu", "n>:Integer total<:Integer inverted<:Boolean"),
        component("n", "CosimMixed.fmu", "n>:Integer on>:Boolean"),
    ]
    wires = [
        connection("a.x -> g.u"),
        connection("a.x -> h.u", linear(factor=2)),
        connection("m.total -> n.n"),
        connection("m.inverted -> n.on"),
        connection("g.y -> out"),
    ]
    return write(tmp_path, system(parts, wires, "out<"))


def run(path, text, **options):
    (path.parent / "s.toml").write_text(text, encoding="utf-8")
    given = {"step_size": STEP, "coupling": "gauss-seidel", "stop_time": 4.0, **options}
    with load(path, start_values={"a.u": 1.0}) as loaded:
        table = Table(loaded.channels)
        result = simulate(loaded, sinks=[table], **grouped(scenario=path.parent / "s.toml", **given))
    return table, result


def fault(kind, signal="g.u", **more):
    keys = {"signal": f'"{signal}"', "kind": f'"{kind}"', **more}
    return "[[faults]]\n" + "".join(f"{key} = {value}\n" for key, value in keys.items())


EVERYTHING = (
    fault("stuck", "n.n", start=0.5, stop=3)
    + fault("stuck", "h.u", value=2, start=1.25, stop=1.75)
    + fault("noise", "a.x", deviation=0.1, start=0.25)
    + fault("dropout", "a.x", probability=0.5, seed=3)
    + fault("delay", "g.u", delay=0.75, start=0.5)
    + fault("delay", "h.u", delay=0.25)
    + fault("stuck", "g.u", start=3.5)
    + '[[parameters]]\ntime = 1.5\nname = "g.k"\nvalue = 4\n[[parameters]]\ntime = 1\nname = "h.k"\nvalue = 4\n'
)
