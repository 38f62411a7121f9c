"""Logs with every awkward name and value, and how the mcap package reads them."""

import itertools
import json
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from twip.cosim.model.signals import Channel, Signal
from twip.cosim.sinks.mcap_log import Attachment, McapLog

AWKWARD = [
    "a.b",
    "a_b",
    "x[1]",
    "x_1_",
    "1st",
    "_hidden",
    "θ",
    "φ",
    "class",
    "from",
    "aB",
    "naïve name",
    "der(x)",
    "A_B",
]
INT32 = (-(2**31), 2**31 - 1)
SPECIAL = [np.nan, -np.nan, np.inf, -np.inf, 0.0, -0.0, 5e-324, -5e-324, 1.7976931348623157e308, 0.1]
SPECIAL_BITS = np.append(
    np.array(SPECIAL).view(np.uint64), np.uint64(0x7FF4DEADBEEF0001)
)  # a signalling NaN with payload


def channels() -> list[Channel]:
    """Return components whose names and variables collide in every way, with all types mixed."""
    kinds = itertools.cycle(["Real", "Real", "Integer", "Real", "Boolean", "Integer", "Real"])
    first = tuple(Signal(n, k, "m/s", "output", f"about {n}") for n, k in zip(AWKWARD, kinds, strict=False))
    return [
        Channel("left.motor", first),
        Channel("left/motor", (Signal("on", "Boolean", None, "input"),)),
        Channel("silent", ()),
        Channel("system", (Signal("q", "Real", "rad", "output"),)),
        Channel("log", (Signal("q", "Integer", None, "output"), Signal("r", "Integer", None, "output"))),
        Channel("", (Signal("push", "Real", "N", "input"),)),
    ]


def table(described: list[Channel], count: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Return times and rows: random values with every special one among them."""
    rng = np.random.default_rng(seed)
    columns = []
    for item in (s for c in described for s in c.signals):
        if item.type == "Integer":
            values = rng.integers(*INT32, count, endpoint=True).astype(float)
            values[: len(INT32)] = INT32[:count]
        elif item.type == "Boolean":
            values = rng.integers(0, 2, count).astype(float)
        else:
            values = rng.normal(size=count)
            values[: len(SPECIAL_BITS)] = SPECIAL_BITS[:count].view(np.float64)
            values = rng.permutation(values)
        columns.append(values)
    return 0.001 * np.arange(count), np.column_stack(columns) if columns else np.zeros((count, 0))


def write(
    path: Path, count: int = 450, described: list[Channel] | None = None, step: int = 77, **options
) -> np.ndarray:
    """Write a log with events in calls of `step` rows; return its rows."""
    described = channels() if described is None else described
    times, rows = table(described, count)
    with McapLog(
        path, described, {"twip": {"seed": "7"}}, [Attachment("a.ssv", "text/xml", b"<x/>")], **options
    ) as log:
        if not count:
            log.begin()
        log.event(0.0, "info", "plant", "begins")
        for i in range(0, count, step):
            log.event(times[i], "warning", "left.motor", f"row {i}")
            log.write(times[i : i + step], rows[i : i + step])
        log.event(99.0, "error", "plant", "ends")
    return rows


def read_by_mcap(path: Path, described: list[Channel]) -> tuple[dict[str, np.ndarray], dict[str, list], list]:
    """Return values (as float64 bits), log times by topic and log messages, through the mcap package and protobuf."""
    values: dict[str, list] = {}
    times: dict[str, list] = {}
    events = []
    with path.open("rb") as stream:
        for schema, channel, message, decoded in make_reader(stream, True, [DecoderFactory()]).iter_decoded_messages():
            assert message.log_time == message.publish_time
            assert message.sequence == len(times.setdefault(channel.topic, []))
            times[channel.topic].append(message.log_time)
            if schema.name == "foxglove.Log":
                events.append((message.log_time, decoded))
                continue
            component = channel.metadata["twip.component"]
            for field in decoded.DESCRIPTOR.fields:
                about = json.loads(channel.metadata[field.name])
                values.setdefault((component, about["name"]), []).append(getattr(decoded, field.name))
    ordered = [np.array(values[c.component, s.name], float) for c in described for s in c.signals]
    return np.column_stack(ordered).view(np.uint64), times, events
