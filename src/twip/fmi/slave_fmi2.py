"""A block behind pythonfmu, as an FMI 2.0 co-simulation FMU."""

from pythonfmu import Fmi2Slave

from .messages import DISCARD
from .slave import BlockSlave


class BlockSlave2(BlockSlave, Fmi2Slave):  # type: ignore[misc]
    """One instance of a block in FMI 2.0."""

    binaries = "linux64"
    logs_formats = True
    refusal = DISCARD  # pythonfmu has no other status for a step that was not done
