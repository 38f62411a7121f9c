"""What a model description says of an FMU: of a block or of a container, in FMI 2.0 or FMI 3.0."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from lxml import etree

from .declare import Block, Variable
from .messages import LOG_CATEGORIES
from .table import exposed, unit_of
from .units import BASE_UNITS, UNITS

FMI_VERSIONS = ("2.0", "3.0")
"""Versions of FMI that FMUs are written in."""


@dataclass(frozen=True)
class Capabilities:
    """What an instance can do."""

    needs_execution_tool: bool = True
    """A Python interpreter."""
    variable_step: bool = True
    only_once: bool = False
    """Whether a process may hold one instance only."""
    state: bool = True
    """Whether the state can be saved, restored and serialised."""
    host_memory: bool = False
    """Whether it takes memory from the callbacks of FMI 2.0 alone."""
    fixed_step: float | None = None
    """Step of the inside in s; the communication step must be a whole multiple of it."""


@dataclass(frozen=True)
class Interface:
    """The face of an FMU. A variable's value reference is `first_reference` plus its index."""

    name: str
    description: str
    variables: tuple[Variable, ...]
    units: tuple[etree._Element, ...]
    """`Unit` elements, the same in FMI 2.0 and 3.0."""
    step_size: float
    stop_time: float
    identifier: str
    """Name of the library, and prefix of the C functions where they have one."""
    capabilities: Capabilities = Capabilities()
    categories: Mapping[str, str] = field(default_factory=lambda: dict(LOG_CATEGORIES))
    first_reference: int = 0
    time_reference: int = 0
    """Value reference of the independent variable in FMI 3.0, where it must be declared."""
    sources: tuple[str, ...] = ()
    """C files of which the FMU can be built."""
    native: bool = False
    """Whether it offers native functions (docs/native_functions.md)."""
    initially_all: bool = False
    """Whether initial values depend on all that can be set; otherwise on the declared inputs and all parameters."""

    @property
    def references(self) -> dict[str, int]:
        """Return the value references by name."""
        return {v.name: self.first_reference + i for i, v in enumerate(self.variables)}


def interface_of(block: Block) -> Interface:
    """Return the face of a block that keeps the rules of `rules.py`."""
    variables = exposed(block)
    used = {unit_of(v) for v in variables}
    units = tuple(unit_element(name) for name in UNITS if name in used)
    return Interface(
        block.name,
        block.description,
        variables,
        units,
        block.step_size,
        block.stop_time,
        block.name,
        time_reference=len(variables),
        native=True,
    )


def unit_element(name: str) -> etree._Element:
    """Return the definition of a unit of our table."""
    unit = etree.Element("Unit", {"name": name})
    exponents = UNITS[name].exponents
    if exponents is not None:
        etree.SubElement(unit, "BaseUnit", {b: str(exponents[b]) for b in BASE_UNITS if exponents.get(b)})
    for display, factor in UNITS[name].display.items():
        etree.SubElement(unit, "DisplayUnit", {"name": display, "factor": repr(factor)})
    return unit
