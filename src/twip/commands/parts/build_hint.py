"""Says what is to be done with the source of a system, whose FMUs are still to be built."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ...errors import TwipError
from ...fmi import SSD, needed_fmus


@contextmanager
def told_to_build(path: str) -> Iterator[None]:
    """Add to what is wrong with the system at `path` that `twip build` packs it, where it is a folder of sources."""
    try:
        yield
    except TwipError as error:
        if not _is_source(Path(path)):
            raise
        ssp = Path(path).with_suffix(".ssp")
        hint = f"{path} is the source of a system, without its FMUs: twip build packs both into ssp/{ssp.name}"
        raise TwipError([*error.problems, hint]) from None


def _is_source(folder: Path) -> bool:
    """Tell whether a folder describes a system of blocks whose FMUs are missing and whose sources are beside it."""
    blocks = folder.resolve().parent.parent / "fmus"
    if not (blocks.is_dir() and (folder / SSD).is_file()):
        return False
    try:
        return any((blocks / name / f"{name}.py").is_file() for name in needed_fmus(folder))
    except TwipError:  # it is no XML, which has been told
        return False
