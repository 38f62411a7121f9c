"""Keeps a command from writing over what it reads, or twice into one file."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from ...errors import TwipError
from ...lab.endings import check_ending


def beside(log: Path, ending: str) -> Path:
    """Return the path of a log with another ending, such as `.png` or `-sweep.html`.

    Raises TwipError where `log` is not the name of a file.
    """
    if not log.name or log.is_dir():
        raise TwipError(f"{log}: must be a file")
    return log.with_name(f"{log.stem}{ending}")


def made_from(logs: Sequence[Path], out: Path | None, endings: Sequence[str]) -> Path:
    """Return the file that a command makes of logs: `out`, else beside the first log with the first ending.

    Raises TwipError, before anything is read, for an ending that the command does not write, and for one of the logs.
    """
    path = out or beside(logs[0], endings[0])
    check_ending(path, endings)
    refuse_clashes([("LOG.mcap", log) for log in logs], {"--out": path})
    return path


def refuse_clashes(reads: Sequence[tuple[str, Path | str | None]], writes: Mapping[str, Path | None]) -> None:
    """Raise TwipError when two of the files to write, or one to write and one to read, are the same.

    `reads` are (what, path), `writes` map the option that names a file to its path; None is no file.
    """
    known = {Path(path).resolve(): (f"reads it ({what})") for what, path in reads if path is not None}
    problems = []
    for option, path in writes.items():
        if path is None:
            continue
        file = path.resolve()
        if file in known:
            problems.append(f"{option} {path}: the command also {known[file]}")
        known[file] = f"writes it ({option})"
    if problems:
        raise TwipError(problems)
