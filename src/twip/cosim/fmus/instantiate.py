"""Makes an instance of a component, whatever its version of FMI."""

import pathlib

import numpy as np
from numpy.typing import NDArray

from ..model.message import Message
from ..model.system import Component
from .component import Instance
from .instance_fmi2 import Fmi2Instance
from .instance_fmi3 import Fmi3Instance


def instantiate(
    component: Component,
    folder: pathlib.Path,
    messages: list[Message],
    dead: set[pathlib.Path],
    clock: NDArray[np.float64],
) -> Instance:
    """Return a new instance of the FMU unpacked in `folder`; the arguments are those of `Instance`."""
    kind = Fmi2Instance if component.fmu.fmi_version == "2.0" else Fmi3Instance
    return kind(component, folder, messages, dead, clock)
