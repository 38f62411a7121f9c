"""The face of a container: open inputs, all outputs and all parameters of its components, as `component.variable`."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from lxml import etree

from ..errors import TwipError
from .declare import Variable
from .description_variable import value_text
from .interface import Capabilities, Interface
from .nested import KINDS, Connection, Connector, Name, Nested, NestedFmu

VARIABILITY = {
    "parameter": ("fixed", "tunable"),
    "input": ("continuous", "discrete"),
    "output": ("continuous", "discrete"),
}
"""What a container shows, by causality: the first is what a Real without another of them has."""


@dataclass
class ContainerInterface:
    """Variables of a container, and what they stand for."""

    variables: list[Variable] = field(default_factory=list)
    types: dict[str, str] = field(default_factory=dict)
    """As the container's library calls them."""
    targets: dict[str, list[Name]] = field(default_factory=dict)
    left_out: list[str] = field(default_factory=list)
    units: list[etree._Element] = field(default_factory=list)
    needs_execution_tool: bool = False
    only_once: bool = False

    def interface(self, name: str, description: str, step_size: float, stop_time: float) -> Interface:
        """Return the face to write. Value reference 0 is time, also where FMI 2.0 does not show it."""
        abilities = Capabilities(self.needs_execution_tool, False, self.only_once, False, fixed_step=step_size)
        categories = {
            "logStatusError": "the container refuses something",
            "logFMICalls": "calls of the components",
            "logNested": "what the components say",
        }
        return Interface(
            name, description, tuple(self.variables), tuple(self.units), step_size, stop_time, "container_fmu",
            abilities, categories, first_reference=1, initially_all=True,
        )  # fmt: skip

    def start_text(self, v: Variable) -> str:
        """Return a start value as the container's library reads it."""
        return value_text(v.type, v.start or 0.0)


def interface_of_container(
    components: Sequence[Nested],
    inputs: Sequence[Connector],
    outputs: Sequence[Connector],
    connections: Sequence[Connection],
    fmus: Mapping[str, NestedFmu],
) -> ContainerInterface:
    """Return the face of a container. Raises TwipError with a line for each thing that cannot go into one."""
    face = ContainerInterface()
    problems = [
        f"{'.'.join(c.source)} → {'.'.join(c.destination)}: a container carries no {_what(fmus, c.source)}"
        for c in connections
        if fmus[c.source[0]].kind(c.source[1]) is None
    ]
    problems += [
        f"{'.'.join(c.source)} → {'.'.join(c.destination)}: types differ"
        for c in connections
        if fmus[c.source[0]].kind(c.source[1]) != fmus[c.destination[0]].kind(c.destination[1])
    ]
    _add_units(face, fmus, problems)
    fed = {c.destination for c in connections} | {name for connector in inputs for name in connector.behind}
    for connector in inputs:
        owner, variable = connector.behind[0]
        start = fmus[owner].inherited(variable, "start") if connector.start is None else connector.start
        _add(face, connector.name, connector.behind, fmus, start, problems)
    for component in components:
        fmu = fmus[component.name]
        face.needs_execution_tool |= bool(fmu.description.coSimulation.needsExecutionTool)
        face.only_once |= bool(fmu.description.coSimulation.canBeInstantiatedOnlyOncePerProcess)
        shown = [
            v.name
            for causality in VARIABILITY
            for v in fmu.description.modelVariables
            if v.causality == causality and v.variability != "constant" and (component.name, v.name) not in fed
        ]
        for name in shown:
            start = component.start_values.get(name, fmu.inherited(name, "start"))
            _add(face, f"{component.name}.{name}", ((component.name, name),), fmus, start, problems)
        problems += [
            f"{component.name}.{name} = {value}: a container cannot start it with another value than its FMU's"
            for name, value in component.start_values.items()
            if f"{component.name}.{name}" not in face.targets and (component.name, name) not in fed
        ]
    for connector in outputs:
        _add(face, connector.name, connector.behind, fmus, None, problems)
    if problems:
        raise TwipError(problems)
    _add_dependencies(face, fmus)
    return face


def _add(
    face: ContainerInterface,
    name: str,
    behind: tuple[Name, ...],
    fmus: Mapping[str, NestedFmu],
    start: object,
    problems: list[str],
) -> None:
    component, variable = behind[0]
    fmu = fmus[component]
    kind, v = fmu.kind(variable), fmu.variables[variable]
    if kind is None:
        face.left_out.append(f"{name} is not shown: a container carries no {_what(fmus, behind[0])}")
        return
    if name in face.targets:
        problems.append(f"{name} is the name of more than one variable or connector")
        return
    type_ = KINDS[v.type][1]
    known = VARIABILITY[v.causality]
    variability = v.variability if v.variability in known else known[0]
    if v.causality != "parameter" and type_ != "Real":
        variability = "discrete"

    def number(attribute: str, types: tuple[str, ...]) -> float | None:
        text = fmu.inherited(variable, attribute) if type_ in types else None
        return None if text is None else float(text)

    face.variables.append(
        Variable(
            name,
            v.causality,
            variability,
            type_,
            fmu.inherited(variable, "unit") if type_ == "Real" else None,
            fmu.inherited(variable, "displayUnit") if type_ == "Real" else None,
            number("min", ("Real", "Integer")),
            number("max", ("Real", "Integer")),
            number("nominal", ("Real",)),
            start=None if v.causality == "output" else _number(start),
            description=v.description or "",
            relative=variable in fmu.differences,
        )
    )
    face.types[name] = kind
    face.targets[name] = list(behind)


def _number(start: object) -> float:
    """Return a start value as a number; none is 0."""
    text = str(start).lower()
    return {"true": 1.0, "false": 0.0, "none": 0.0}[text] if text in ("true", "false", "none") else float(text)


def _what(fmus: Mapping[str, NestedFmu], name: Name) -> str:
    v = fmus[name[0]].variables[name[1]]
    return f"{'array' if v.dimensions else 'variable'} of type {v.type}"


def _add_units(face: ContainerInterface, fmus: Mapping[str, NestedFmu], problems: list[str]) -> None:
    """Collect the units of all FMUs; a name that stands for two units is a problem."""
    found: dict[str, tuple[bytes, str]] = {}
    for component, fmu in fmus.items():
        for unit in fmu.units():
            name, text = str(unit.get("name")), etree.tostring(unit)
            if name not in found:
                found[name] = (text, component)
                face.units.append(unit)
            elif found[name][0] != text:
                problems.append(f"unit {name} of {component} is not that of {found[name][1]}")


def _add_dependencies(face: ContainerInterface, fmus: Mapping[str, NestedFmu]) -> None:
    """Let each output depend on those shown inputs that its own component passes on at the same instant."""
    shown = {target: name for name, targets in face.targets.items() for target in targets}
    inputs = {v.name for v in face.variables if v.causality == "input"}
    for i, v in enumerate(face.variables):
        if v.causality == "output":
            component, variable = face.targets[v.name][0]
            near = (shown.get((component, d)) for d in fmus[component].depends(variable, initially=False))
            names = sorted({n for n in near if n in inputs})
            face.variables[i] = replace(v, depends=tuple(names))
