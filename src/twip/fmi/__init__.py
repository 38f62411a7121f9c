"""From the declaration of a block to a complete FMI 2.0 co-simulation FMU, and from FMUs and wiring to an .ssp."""

from typing import TYPE_CHECKING

from ..lazy import later

if TYPE_CHECKING:
    from .build import build_all, build_fmi3, build_native
    from .container import Container, write_container
    from .declare import Variable
    from .interface import FMI_VERSIONS
    from .native.container import Wiring, write_native_container
    from .native.system_source import Link, Stage
    from .nested import Connection, Connector, Name, Nested
    from .replay import Recording, write_replay
    from .rules import NAME
    from .ssp_package import SSD, needed_fmus
    from .units import UNITS
else:  # packaging takes its time to load, and the declaration of a block does without
    __getattr__ = later(
        __name__,
        {
            "build": (
                "build_all",
                "build_fmi3",
                "build_native",
            ),
            "container": (
                "Container",
                "write_container",
            ),
            "declare": ("Variable",),
            "interface": ("FMI_VERSIONS",),
            "native.container": (
                "Wiring",
                "write_native_container",
            ),
            "native.system_source": (
                "Link",
                "Stage",
            ),
            "nested": (
                "Connection",
                "Connector",
                "Name",
                "Nested",
            ),
            "replay": (
                "Recording",
                "write_replay",
            ),
            "rules": ("NAME",),
            "ssp_package": (
                "SSD",
                "needed_fmus",
            ),
            "units": ("UNITS",),
        },
    )

__all__ = [
    "FMI_VERSIONS",
    "NAME",
    "SSD",
    "UNITS",
    "Connection",
    "Connector",
    "Container",
    "Link",
    "Name",
    "Nested",
    "Recording",
    "Stage",
    "Variable",
    "Wiring",
    "build_all",
    "build_fmi3",
    "build_native",
    "needed_fmus",
    "write_container",
    "write_native_container",
    "write_replay",
]
