"""Opens an MCAP file, and tells what is wrong with one in a line."""

import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import zstandard
from google.protobuf.message import DecodeError
from mcap.exceptions import McapError

from ...errors import AbsentFileError, TwipError
from ..reading.files import is_endless
from .log_scan import DamagedError

DECODING_ERRORS = (
    DamagedError,
    DecodeError,
    IndexError,
    KeyError,
    McapError,
    MemoryError,
    OverflowError,
    RuntimeError,  # lz4
    TypeError,
    ValueError,  # checksums and UTF-8 too
    struct.error,
    zstandard.ZstdError,
)
"""What the decoders raise at bytes that are not what they claim to be."""


def bytes_of(path: Path) -> bytes:
    """Return what a log holds; raises TwipError when it cannot be read or is empty."""
    if is_endless(path):
        raise TwipError(f"log {str(path)!r} is a device, not a file")
    try:
        data = path.read_bytes()
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        text = f"log {str(path)!r} cannot be read: {reason}"
        absent = isinstance(error, FileNotFoundError)
        raise (AbsentFileError(text, path=path) if absent else TwipError(text)) from error
    if not data:
        raise TwipError(f"log {str(path)!r} is empty")
    return data


@contextmanager
def damage_told(path: Path) -> Iterator[None]:
    """Turn what the decoders raise into a TwipError of one line."""
    try:
        yield
    except DECODING_ERRORS as error:
        raise TwipError(f"log {str(path)!r} is damaged or no MCAP file: {reason_of(error)}") from error


def reason_of(error: Exception) -> str:
    """Return the first line of what a decoder said, with its kind unless the line is ours."""
    reason = (str(error).splitlines() or [""])[0]
    return reason if isinstance(error, DamagedError) else f"{type(error).__name__} {reason}".strip()
