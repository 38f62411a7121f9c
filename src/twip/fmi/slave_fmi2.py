"""A block behind pythonfmu, as an FMI 2.0 co-simulation FMU."""

from pythonfmu import Fmi2Slave

from .slave import BlockSlave


class BlockSlave2(BlockSlave, Fmi2Slave):  # type: ignore[misc]
    """One instance of a block in FMI 2.0."""

    binaries = "linux64"
    logs_formats = True
