"""The C sources of one block: its functions, its table of variables, and what they stand on."""

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..declare import Block
from ..table import Table
from .checks import SIGNATURE, Check
from .layout import comment
from .source import INITIALIZE, STEP, Signature
from .table_source import block_model_source, variables_source
from .translate import Unit

RUNTIME = Path(__file__).with_name("c")
"""The C that all FMUs share."""

LAYERS = {"2.0": "fmi2.c", "3.0": "fmi3.c"}
HEADERS = ("twip_number.h", "twip_text.h", "twip_model.h", "twip_instance.h")
FREESTANDING = "freestanding.c"
"""Only for libraries that are linked without a C library."""


def block_source(block: Block) -> str:
    """Return the C file of a block: its `initialize`, `check` and `step`, and its variables.

    It defines one symbol, the model `<block>_model`. Raises TwipError, one line per problem with file, line and rule,
    when a function goes beyond the kernel subset.
    """
    table = Table(block)
    signatures: dict[Callable[..., Any], Signature] = {
        block.initialize: INITIALIZE,
        block.step: STEP,
        block.check: SIGNATURE,
    }
    unit = Unit(block.name, table.attributes, signatures)
    initialize, step = unit.require(block.initialize), unit.require(block.step)
    rules = block.check is not Block.__dataclass_fields__["check"].default
    check = unit.require(block.check, Check) if rules else ""
    text = unit.text()
    exposed = len(table.variables)
    parts = [
        comment(f"{block.name}: {block.description}\nMade by twip from the block's Python functions; do not edit."),
        '#include "twip_model.h"\n',
        text,
        variables_source(block.name, list(table.variables.values())),
        block_model_source(block.name, len(table.attributes), exposed, initialize, check, step),
    ]
    return "\n".join(parts)


def identity_source(name: str, model: str, token: str) -> str:
    """Return the header that names the C symbol of an FMU's model, its token and the prefix of its functions."""
    return (
        "/* Which model this FMU is of. */\n"
        f'#define TWIP_MODEL {model}\n#define TWIP_NAME "{name}"\n#define TWIP_TOKEN "{token}"\n'
        f"#define FMI2_FUNCTION_PREFIX {name}_\n#define FMI3_FUNCTION_PREFIX {name}_\n"
    )


def runtime_sources(version: str) -> dict[str, bytes]:
    """Return the C that all FMUs of an FMI version share, by name."""
    names = (*HEADERS, LAYERS[version], FREESTANDING)
    return {name: (RUNTIME / name).read_bytes() for name in names}


def digest_of(files: dict[str, bytes]) -> str:
    """Return the SHA-256 of named contents."""
    digest = hashlib.sha256()
    for name, content in sorted(files.items()):
        digest.update(f"{name}\0{len(content)}\0".encode() + content)
    return digest.hexdigest()
