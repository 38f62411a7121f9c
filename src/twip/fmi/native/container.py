"""A wired system of native FMUs as one native FMU."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ...errors import TwipError
from ...platform import PLATFORMS, Platform
from ..container import Container, joined_origin, nested_fmus
from ..container_interface import interface_of_container
from ..interface import Capabilities, Interface
from ..nested import Name, NestedFmu
from ..origin import licence
from .block_source import RUNTIME
from .package import Model, write_native
from .system_source import Part, Stage, SystemModel, system_source

SYSTEM = "twip_system"
_SIZES = r"^enum {{ {name}_exposed = \d+, {name}_size = (\d+) }};$"
_FACE = "twip_model.h"


@dataclass(frozen=True)
class Wiring:
    """What is done, in order."""

    initial: tuple[Stage, ...]
    """Until initial values settle."""
    stages: tuple[Stage, ...]
    """In a step."""
    words: str
    """The coupling in words, for the documentation page."""


def write_native_container(
    container: Container, wiring: Wiring, fmi: str, output: Path, platforms: Sequence[Platform] = PLATFORMS
) -> list[str]:
    """Write the FMU in version `fmi` (`2.0` or `3.0`) and return what of the system it leaves out, a sentence each.

    The same system gives the same bytes. Raises TwipError, one line per problem, when the system cannot be packed.
    """
    fmus = nested_fmus(container)
    sources, sizes = _sources(fmus)
    face = interface_of_container(
        container.components, container.inputs, container.outputs, container.connections, fmus
    )
    identifier = re.sub(r"\W", "_", container.name, flags=re.ASCII)
    identifier = identifier if identifier[:1].isalpha() else f"system_{identifier}"
    shown: list[tuple[str, Name]] = []
    inputs = {c.name for c in (*container.inputs, *container.outputs)}
    for variable in face.variables:
        shown.append(
            (variable.name, ("", variable.name) if variable.name in inputs else face.targets[variable.name][0])
        )
    connected: dict[str, dict[str, float]] = {}
    for link in (k for stage in (*wiring.initial, *wiring.stages) for k in stage.links if k.destination[0]):
        component, name = link.destination
        nested = next(c for c in container.components if c.name == component)
        start = nested.start_values.get(name, fmus[component].inherited(name, "start"))
        connected.setdefault(component, {})[name] = _number(start)
    system = SystemModel(
        identifier,
        f"{identifier}_system_model",
        [
            Part(
                c.name,
                f"{fmus[c.name].identifier}_model",
                sizes[fmus[c.name].identifier],
                {name: v.valueReference for name, v in fmus[c.name].variables.items()},
                connected.get(c.name, {}),
            )
            for c in container.components
        ],
        wiring.initial,
        wiring.stages,
        [(variable, name) for variable, (_, name) in zip(face.variables, shown, strict=True)],
        container.step_size,
    )
    interface = Interface(
        container.name, container.description, tuple(face.variables), tuple(face.units), container.step_size,
        container.stop_time, identifier,
        Capabilities(needs_execution_tool=False, variable_step=False, host_memory=True, fixed_step=container.step_size),
        time_reference=len(face.variables), initially_all=True,
    )  # fmt: skip
    model = Model(system.symbol, {**sources, f"{SYSTEM}.c": system_source(system).encode()})
    origin = joined_origin(fmus, "twip")
    write_native(interface, model, _readme(container, wiring, fmus), fmi, output, origin, _licences(fmus), platforms)
    return face.left_out


def _number(start: object) -> float:
    text = str(start).lower()
    return {"true": 1.0, "false": 0.0, "none": 0.0}[text] if text in ("true", "false", "none") else float(text)


def _sources(fmus: Mapping[str, NestedFmu]) -> tuple[dict[str, bytes], dict[str, int]]:
    """Return the C files of the blocks by name, and the number of each block's values."""
    sources: dict[str, bytes] = {}
    sizes: dict[str, int] = {}
    problems = []
    for fmu in {fmu.path: fmu for fmu in fmus.values()}.values():
        files, name = fmu.files(), f"{fmu.identifier}.c"
        content = files.get(f"sources/{name}", b"")
        found = re.search(_SIZES.format(name=re.escape(fmu.identifier)), content.decode("utf-8", "replace"), re.M)
        if found is None:
            rule = "a native container is made of native FMUs of blocks (twip build --native)"
            problems.append(f"{fmu.path.name} holds no C of a block: {rule}")
        elif files.get(f"sources/{_FACE}") != (RUNTIME / _FACE).read_bytes():
            problems.append(f"{fmu.path.name} was made by another version of twip: build it again")
        elif sources.setdefault(name, content) != content:
            problems.append(f"{fmu.path.name}: another FMU with other code is also named {fmu.identifier}")
        else:
            sizes[fmu.identifier] = int(found[1])
    if problems:
        raise TwipError(problems)
    return sources, sizes


def _licences(fmus: Mapping[str, NestedFmu]) -> dict[str, bytes]:
    """Return the terms of all blocks."""
    found = {"documentation/licenses/twip.txt": licence().encode()}
    names = []
    for fmu in fmus.values():
        for path, content in fmu.files().items():
            if path.startswith("documentation/licenses/") and fmu.identifier not in names:
                found[f"documentation/licenses/{fmu.identifier}/{path.rpartition('/')[2]}"] = content
        names.append(fmu.identifier)
    overview = "\n".join(f"- the block {name}: see {name}/license.txt" for name in dict.fromkeys(names))
    text = f"This FMU holds\n\n{overview}\n- what joins them, written by twip: see twip.txt\n"
    return {**found, "documentation/licenses/license.txt": text.encode()}


def _readme(container: Container, wiring: Wiring, fmus: Mapping[str, NestedFmu]) -> str:
    """Return the container's documentation page in Markdown."""
    rows = "\n".join(f"| `{c.name}` | {fmus[c.name].model} |" for c in container.components)
    return (
        f"# {container.name}\n\n{container.description}\n\n"
        f"Inside, all components step by {container.step_size:g} s, {wiring.words}; "
        "a communication step must be a whole multiple of that. The FMU holds no Python: C sources in `sources`, "
        "libraries in `binaries`. "
        "Outputs, inputs that nothing inside feeds, and parameters are named `component.variable`.\n\n"
        f"| component | model |\n|---|---|\n{rows}\n"
    )
