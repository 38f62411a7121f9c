"""A wired system of FMUs as one FMU: what goes in, as plain data, and the file.

The inside is run by fmpy's container (fmpy.container_fmu): Jacobi, all connections copied once when initialization ends
and after each step, in the order in which they are listed.
"""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import fmpy.container_fmu

from ..errors import TwipError
from ..platform import LINUX, WINDOWS
from .archive import write_archive
from .container_interface import ContainerInterface, interface_of_container
from .container_order import in_order_of_initialization
from .description import Origin, model_description
from .nested import Connection, Connector, Nested, NestedFmu, read_nested
from .origin import licence, licence_of, version
from .page import documentation_page
from .sources import fingerprint, guid

SERVED = {platform.fmi2: platform for platform in (LINUX, WINDOWS)}
"""The platforms that a container can serve, by FMI 2.0's name."""


@dataclass(frozen=True)
class Container:
    """A system to be packed."""

    name: str
    description: str
    components: tuple[Nested, ...]
    connections: tuple[Connection, ...]
    inputs: tuple[Connector, ...]
    """Connectors of the system that feed inputs of components."""
    outputs: tuple[Connector, ...]
    """Connectors of the system that show one output of a component each."""
    step_size: float
    """Step of the inside in s."""
    stop_time: float
    """Proposed end of a simulation in s."""


def write_container(container: Container, fmi: str, output: Path) -> list[str]:
    """Write the FMU in version `fmi` (`2.0` or `3.0`) and return what of the system it leaves out, a sentence each.

    The same system gives the same bytes. Raises TwipError, one line per problem, when the system cannot be packed.
    """
    fmus = nested_fmus(container)
    known = {fmu.path: fmu for fmu in fmus.values()}
    platforms = [p for p in SERVED if all(p in fmu.platforms for fmu in known.values())]
    if not platforms:
        raise TwipError(f"{container.name}: its FMUs have no platform of {' and '.join(SERVED)} in common")
    connections, loops = in_order_of_initialization(container.connections, fmus)
    face = interface_of_container(container.components, container.inputs, container.outputs, connections, fmus)
    interface = face.interface(container.name, container.description, container.step_size, container.stop_time)
    origin = joined_origin(fmus, f"twip, fmpy.container_fmu {fmpy.container_fmu.__version__}")
    files = {
        f"resources/{fmu.folder}/{name}": content for fmu in known.values() for name, content in fmu.files().items()
    }
    configuration = _configuration(container, connections, face, fmus)
    digest = fingerprint(
        {**files, "container.json": _json(configuration)}, model_description(interface, fmi, "", origin)
    )
    token = guid(digest)
    files["resources/container.json"] = _json({**configuration, "instantiationToken": token})
    files["modelDescription.xml"] = model_description(interface, fmi, token, origin)
    files["documentation/index.html"] = documentation_page(interface, fmi, _readme(container, fmus), token, origin)
    files["documentation/licenses/license.txt"] = (
        b"This FMU holds\n\n"
        b"- the FMUs in resources/, each with its own terms\n"
        b"- the container of fmpy (binaries): see fmpy.txt\n"
        b"- documentation written by twip: see twip.txt\n"
    )
    files["documentation/licenses/fmpy.txt"] = licence_of("fmpy")
    files["documentation/licenses/twip.txt"] = licence().encode()
    binaries = Path(fmpy.container_fmu.__file__).parent / "binaries"
    for platform in platforms:
        fmi2, fmi3, ending = SERVED[platform]
        library = f"container_fmu.{ending}"
        files[f"binaries/{fmi2 if fmi == '2.0' else fmi3}/{library}"] = (binaries / fmi3 / library).read_bytes()
    write_archive(output, files, first="modelDescription.xml")
    return face.left_out + loops


def nested_fmus(container: Container) -> dict[str, NestedFmu]:
    """Return the FMUs of a container's components by component, each file read once."""
    known: dict[Path, NestedFmu] = {}
    for component in container.components:
        if component.fmu not in known:
            known[component.fmu] = read_nested(component.fmu, _folder(component.fmu, known))
    return {component.name: known[component.fmu] for component in container.components}


def joined_origin(fmus: Mapping[str, NestedFmu], tool: str) -> Origin:
    """Return the origin of what `tool` makes of FMUs."""

    def all_of(texts: Iterable[str]) -> str:
        return "; ".join(dict.fromkeys(t for t in texts if t))

    return Origin(
        all_of(fmu.author for fmu in fmus.values()),
        version(),
        all_of(fmu.license for fmu in fmus.values()),
        all_of(fmu.copyright for fmu in fmus.values()),
        tool,
    )


def _folder(fmu: Path, known: Mapping[Path, NestedFmu]) -> str:
    """Return the name of the folder in resources/ that takes an FMU."""
    taken = {other.folder for other in known.values()}
    name = "".join(c if c.isascii() and (c.isalnum() or c in "_-") else "_" for c in fmu.stem)
    number = 2
    while name in taken:
        name = f"{name.rstrip('0123456789')}{number}"
        number += 1
    return name


def _configuration(
    container: Container, connections: list[Connection], face: ContainerInterface, fmus: Mapping[str, NestedFmu]
) -> dict[str, object]:
    """Return what the container's library reads, without the token."""
    index = {component.name: i for i, component in enumerate(container.components)}
    variables = [
        {
            "variableType": face.types[v.name],
            "mappings": [[index[c], fmus[c].variables[n].valueReference] for c, n in face.targets[v.name]],
            **({"start": [face.start_text(v)]} if v.start is not None else {}),
        }
        for v in face.variables
    ]
    groups: list[dict[str, object]] = []
    for c in connections:
        source, target = (fmus[component].variables[name] for component, name in (c.source, c.destination))
        group = {
            "variableType": fmus[c.source[0]].kind(c.source[1]),
            "srcComponent": index[c.source[0]],
            "dstComponent": index[c.destination[0]],
        }
        if not groups or any(groups[-1][key] != value for key, value in group.items()):
            groups.append({**group, "srcValueReferences": [], "dstValueReferences": [], "size": 0})
        newest = groups[-1]
        newest["srcValueReferences"] = [*_list(newest["srcValueReferences"]), source.valueReference]
        newest["dstValueReferences"] = [*_list(newest["dstValueReferences"]), target.valueReference]
        newest["size"] = len(_list(newest["srcValueReferences"]))
    return {
        "containerVersion": fmpy.container_fmu.__version__,
        "fixedStepSize": container.step_size,
        "parallelDoStep": False,
        "components": [
            {
                "fmiMajorVersion": fmus[c.name].fmi[0],
                "name": c.name,
                "instantiationToken": fmus[c.name].token,
                "modelIdentifier": fmus[c.name].identifier,
                "path": fmus[c.name].folder,
            }
            for c in container.components
        ],
        "variables": variables,
        "connections": groups,
    }


def _list(value: object) -> list[object]:
    return value if isinstance(value, list) else []


def _json(value: object) -> bytes:
    return (json.dumps(value, ensure_ascii=False, indent=1) + "\n").encode()


def _readme(container: Container, fmus: Mapping[str, NestedFmu]) -> str:
    """Return the container's documentation page in Markdown."""
    rows = "\n".join(
        f"| `{c.name}` | {fmus[c.name].model} | `resources/{fmus[c.name].folder}` |" for c in container.components
    )
    return (
        f"# {container.name}\n\n{container.description}\n\n"
        f"Inside, all FMUs step by {container.step_size:g} s with the values of the beginning of the step (Jacobi); "
        "a communication step must be a whole multiple of that. "
        "Outputs, inputs that nothing inside feeds, and parameters are named `component.variable`.\n\n"
        f"| component | model | in this archive |\n|---|---|---|\n{rows}\n"
    )
