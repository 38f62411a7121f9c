"""Logs in MCAP: written during a run and read back; here what tools for logs of any kind need."""

from .log_event import LEVELS
from .log_event import encode as encode_event
from .log_extra import ExtraChannel
from .log_open import DECODING_ERRORS, bytes_of, damage_told, reason_of
from .log_rows import MESSAGE_HEAD, RowBlock
from .log_scan import BODY_HEAD, DamagedError, Scan, scan
from .log_schema import field_numbers, layout, unique_identifiers, varint
from .sole_file import InUseError, SoleFile

__all__ = [
    "BODY_HEAD",
    "DECODING_ERRORS",
    "LEVELS",
    "MESSAGE_HEAD",
    "DamagedError",
    "ExtraChannel",
    "InUseError",
    "RowBlock",
    "Scan",
    "SoleFile",
    "bytes_of",
    "damage_told",
    "encode_event",
    "field_numbers",
    "layout",
    "reason_of",
    "scan",
    "unique_identifiers",
    "varint",
]
