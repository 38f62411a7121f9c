"""What there is to say of a checked system, an FMU or a file of parameters or signals before anything runs."""

import pathlib
from collections.abc import Sequence
from dataclasses import dataclass, field

import fmpy.validation

from .coupling.coupling import Coupling
from .coupling.scheduling import make_schedule
from .model.fmu import Fmu
from .model.system import System
from .model.time_grid import TimeGrid
from .reading.wording import counted
from .scenario.plan import Scenario
from .ssp.ssb import SignalDictionary
from .ssp.ssm import ParameterMapping
from .ssp.ssv import ParameterSet
from .values.transformation import Transformation
from .values.variable import Variable

_DEPARTURES = 3
"""Most warnings of an FMU's model description in the overview of a system."""


@dataclass(frozen=True)
class Section:
    """A title, what it says, and lines of (name, text) below it."""

    title: str
    text: str
    lines: Sequence[tuple[str, str]] = field(default=())


def system_overview(system: System, grid: TimeGrid, coupling: Coupling, scenario: Scenario) -> list[Section]:
    """Say what a run of `system` would be."""
    driven = scenario.inputs.columns.tolist()
    plan = make_schedule(system, coupling, driven)
    names = system.columns
    signals = [signal for channel in system.channels for signal in channel.signals]
    in_order = [system.components[i] for i in plan.order]
    loops = [("", loop) for loop in plan.loops]
    kept = unconnected(system, set(driven))
    sections = [
        Section("system", f"{system.name} ({system.file}), {len(names)} recorded variables"),
        Section("time", f"{grid.start:g} s to {grid.stop:g} s, {_steps(grid, coupling)}"),
        Section("coupling", coupling.name, _coupling_lines(coupling, grid)),
        Section(
            "components", f"{len(in_order)}, in the order of evaluation", [(c.name, brief(c.fmu)) for c in in_order]
        ),
        Section("connections", str(len(system.copies))),
        Section("algebraic loops", str(len(loops)) if loops else "none", loops),
        Section("unconnected inputs", f"{len(kept)}, which keep their values" if kept else "none", kept),
    ]
    if driven:
        lines = [(names[column], signals[column].unit or "") for column in driven]
        sections.append(Section("time series", f"{len(driven)}", lines))
    entries = list(scenario.described().items())
    if entries:
        sections.append(Section("scenario", f"{len(entries)} parameter changes and faults", entries))
    return sections


def _steps(grid: TimeGrid, coupling: Coupling) -> str:
    if coupling.control is None:
        return f"{grid.steps} steps of {grid.step_size:g} s"
    return f"variable steps, the first of {grid.step_size:g} s, tolerance {coupling.control.tolerance:g}"


def _coupling_lines(coupling: Coupling, grid: TimeGrid) -> list[tuple[str, str]]:
    lines = [("at mid-step", name) for name in coupling.mid_step]
    lines += [("own step", f"{name}, {count * grid.step_size:g} s") for name, count in coupling.own_steps]
    return lines + coupling.algorithm.described(coupling.settings)


def unconnected(system: System, driven: set[int]) -> list[tuple[str, str]]:
    """Return the inputs that nothing feeds, and the value in its unit that each keeps, as text."""
    idle = {connector.column for connector in system.open_connectors} - driven
    fed = {copy.destination for copy in system.copies if copy.source not in idle} | driven
    found = []
    for component in system.components:
        given = {start.variable.name: start.value for start in component.start_values}
        for i, variable in enumerate(component.inputs):
            if system.first_column[component.name] + i not in fed:
                value = given.get(variable.name, variable.start if variable.start is not None else "unknown")
                found.append((f"{component.name}.{variable.name}", with_unit(value, variable)))
    return found


def brief(fmu: Fmu) -> str:
    """Return an FMU in one line."""
    counts = [counted(len(fmu.ports(kind)), kind) for kind in ("input", "output")]
    counts.append(counted(sum(v.causality == "parameter" for v in fmu.variables.values()), "parameter"))
    return f"{fmu.name}, FMI {fmu.fmi_version}, {', '.join(counts)}" + (
        f", by {tool}" if (tool := fmu.generation_tool) else ""
    )


def fmu_overview(fmu: Fmu) -> list[Section]:
    """Say what an FMU offers."""
    able = "can be saved and restored" if fmu.serializes_state else "cannot be saved: no checkpoints"
    step = "none proposed" if fmu.step_size is None else f"{fmu.step_size:g} s proposed"
    sections = [
        Section("FMU", f"{fmu.name}, FMI {fmu.fmi_version} co-simulation"),
        Section("model", f"{fmu.model_identifier}" + (f", by {fmu.generation_tool}" if fmu.generation_tool else "")),
        Section("instances", "one per process" if fmu.only_once else "any number"),
        Section("step", step),
        Section("state", able),
    ]
    for kind in ("input", "output", "parameter"):
        found = [v for v in fmu.variables.values() if v.causality == kind]
        sections.append(Section(f"{kind}s", str(len(found)), [(v.name, _described(v, fmu)) for v in found]))
    return sections


def weaknesses(path: pathlib.Path) -> list[str]:
    """Return in what an FMU's model description departs from the standard, one line each."""
    try:
        found: list[str] = fmpy.validation.validate_fmu(str(path))
    except Exception as error:  # fmpy raises bare exceptions of many kinds
        found = [f"the model description cannot be validated: {error}"]
    return [" ".join(line.split()) for line in found]


def departures(system: System) -> list[str]:
    """Return in what the FMUs' model descriptions depart from the standard, the first few of each FMU."""
    found = []
    for path, name in {component.fmu.path: component.fmu.name for component in system.components}.items():
        lines = weaknesses(path)
        found += [f"{name}: {line}" for line in lines[:_DEPARTURES]]
        if len(lines) > _DEPARTURES:
            found.append(f"{name}: {len(lines) - _DEPARTURES} more, which twip check tells of the FMU alone")
    return found


def set_overview(name: str, parameters: ParameterSet) -> list[Section]:
    """Say what a parameter set holds."""
    lines = [(p.name, f"{p.text}{f' {p.unit}' if p.unit else ''} ({p.type})") for p in parameters.parameters]
    return [Section("parameter set", f"{name}, {counted(len(lines), 'parameter')}", lines)]


def mapping_overview(name: str, mapping: ParameterMapping) -> list[Section]:
    """Say what a parameter mapping holds."""
    lines = [(e.source, f"→ {e.target}{_transformed(e.transformation)}") for e in mapping.entries]
    return [Section("parameter mapping", f"{name}, {len(lines)} entries", lines)]


def _transformed(transformation: Transformation | None) -> str:
    if transformation is None:
        return ""
    if transformation.kind == "linear":
        return f", times {transformation.affine.factor:g} plus {transformation.affine.offset + 0.0:g}"
    count = len(transformation.names) + len(transformation.numbers)
    return f", by a table of {count} {transformation.kind} values"


def dictionary_overview(name: str, dictionary: SignalDictionary) -> list[Section]:
    """Say what a signal dictionary holds."""
    lines = [
        (entry.name, f"{entry.type.type or ''}{f' in {entry.type.unit}' if entry.type.unit else ''}")
        for entry in dictionary.entries.values()
    ]
    return [Section("signal dictionary", f"{name}, {len(lines)} signals", lines)]


def with_unit(value: object, variable: Variable) -> str:
    """Return a value as text, with its unit."""
    text = str(value).lower() if isinstance(value, bool) else str(value)
    return f"{text} {variable.unit.name}" if variable.unit else text


def _described(variable: Variable, fmu: Fmu) -> str:
    start = "" if variable.start is None else variable.start
    parts = [with_unit(start, variable).strip(), variable.type, variable.variability]
    if variable.relative:
        parts.append("a difference")
    if variable.minimum is not None or variable.maximum is not None:
        low, high = ("" if bound is None else f"{bound:g}" for bound in (variable.minimum, variable.maximum))
        parts.append(f"from {low or '-∞'} to {high or '∞'}")
    if variable.causality == "output":
        needed = fmu.feedthrough.get(variable.name, frozenset())
        parts.append(f"follows {', '.join(sorted(needed))} at once" if needed else "follows no input at once")
    return ", ".join(part for part in parts if part) + (f": {variable.description}" if variable.description else "")
