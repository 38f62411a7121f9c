"""Where the blocks, the wiring and the licence are, in a checkout or beside an installed package."""

import importlib.util
import sys
import traceback
from pathlib import Path

from ..errors import TwipError
from .declare import Block

PACKAGE = Path(__file__).parents[1]
"""Folder of the package `twip`."""


def source_root() -> Path:
    """Return the folder that holds `fmus/` and `ssp/`: the repository of a checkout, or the installed package."""
    for root in (PACKAGE, PACKAGE.parents[1]):
        if (root / "fmus").is_dir():
            return root
    raise TwipError(f"no folder fmus/ in {PACKAGE} or {PACKAGE.parents[1]}: this installation lacks the blocks")


def block_folders(root: Path | None = None) -> dict[str, Path]:
    """Return the folders `fmus/<block>/` that hold a face `<block>.py`, by block name, sorted."""
    folder = (root or source_root()) / "fmus"
    return {p.name: p for p in sorted(folder.iterdir()) if (p / f"{p.name}.py").is_file()}


def load_block(face: Path) -> Block:
    """Import a face and return its `BLOCK`.

    A face that cannot be imported, or does not declare the block it is named after, raises TwipError.
    """
    specification = importlib.util.spec_from_file_location(f"twip_face_{face.stem}", face)
    if specification is None or specification.loader is None or not face.is_file():
        raise TwipError(f"{face}: no such Python file")
    module = importlib.util.module_from_spec(specification)
    keep = sys.dont_write_bytecode
    sys.dont_write_bytecode = True  # the folders of the blocks hold sources only
    try:
        specification.loader.exec_module(module)
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{last.filename}, line {last.lineno}"
        raise TwipError(f"{face}: cannot be imported: {type(error).__name__}: {error} ({where})") from error
    finally:
        sys.dont_write_bytecode = keep
    block = getattr(module, "BLOCK", None)
    if not isinstance(block, Block):
        raise TwipError(f"{face}: a block must define BLOCK = Block(...)")
    if block.name != face.stem:
        raise TwipError(f"{face}: the block is named {block.name!r}, its file {face.stem!r}: they must agree")
    return block
