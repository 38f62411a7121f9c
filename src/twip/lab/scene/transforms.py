"""Poses of frames as `foxglove.FrameTransforms`, the public schema from which viewers place what they draw.

All messages have one size, so that a chunk is laid out at once in numpy: numbers of variable width, such as the
timestamp's, are padded, which protobuf allows.
"""

import struct
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from google.protobuf.descriptor_pb2 import DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet
from google.protobuf.timestamp_pb2 import DESCRIPTOR as TIMESTAMP_FILE
from numpy.typing import NDArray

from ...cosim.log import varint

POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")
"""Numbers of a pose: translation in m, rotation as a unit quaternion."""
VARINT = 5
"""Bytes of a padded number: up to 2^35."""
NANOS = b"\x10"
"""Tag of a timestamp's nanoseconds."""


@dataclass(frozen=True)
class Column:
    """A quantity that moves: a column of the rows times a factor."""

    index: int
    factor: float = 1.0


@dataclass(frozen=True)
class Frame:
    """A frame in its parent's: at a place in m, turned by an angle in rad about axis `z` (left) or `y` (forward)."""

    parent: str
    name: str
    axis: str
    angle: Column
    place: tuple[Column | float, Column | float, Column | float] = (0.0, 0.0, 0.0)


class TransformChannel:
    """The channel `topic`, with poses of all frames in the first row and then in the first one of each 1/`rate` s."""

    message_encoding = "protobuf"
    schema_name = "foxglove.FrameTransforms"
    schema_encoding = "protobuf"

    def __init__(self, frames: Sequence[Frame], rate: float, topic: str = "/tf") -> None:
        self.topic = topic
        self.schema = _schema()
        self._period = round(1e9 / rate)
        self._next = 0
        message, stamps, places, sines, cosines = bytearray(), list[int](), list[int](), list[int](), list[int]()
        moving: list[Column] = []
        for frame in frames:
            content, stamp, numbers = _transform(frame)
            message += b"\x0a" + varint(len(content))
            numbers = [len(message) + at for at in numbers]
            stamps.append(len(message) + stamp)
            sines.append(numbers[POSE.index(f"q{frame.axis}")])
            cosines.append(numbers[POSE.index("qw")])
            for place, at in zip(frame.place, numbers, strict=False):
                if isinstance(place, Column):
                    moving.append(place)
                    places.append(at)
            message += content
        self._template = np.frombuffer(bytes(message), np.uint8)
        self._stamps = np.concatenate([np.arange(at, at + 2 * VARINT + 1) for at in stamps])
        self._numbers = np.concatenate([np.arange(at, at + 8) for at in (*places, *sines, *cosines)])
        self._columns = np.array([c.index for c in moving] + [frame.angle.index for frame in frames])
        self._factors = np.array([c.factor for c in moving] + [0.5 * frame.angle.factor for frame in frames])
        self._places = len(moving)
        self._count = len(frames)

    def messages(
        self, nanoseconds: NDArray[np.uint64], rows: NDArray[np.float64]
    ) -> tuple[NDArray[np.uint64], NDArray[np.uint8]]:
        """See `ExtraChannel.messages`."""
        last = int(nanoseconds[-1]) if len(nanoseconds) else -1
        edges = np.arange(self._next, last + 1, self._period, dtype=np.uint64)
        due = np.searchsorted(nanoseconds, edges)
        if (due[1:] == due[:-1]).any():
            due = np.unique(due)
        self._next += len(edges) * self._period
        times = nanoseconds[due]
        data = np.empty((len(due), len(self._template)), np.uint8)
        data[:] = self._template
        stamp = np.empty((len(due), 2 * VARINT + 1), np.uint8)
        stamp[:, :VARINT] = _padded(times // np.uint64(10**9))
        stamp[:, VARINT] = NANOS[0]
        stamp[:, VARINT + 1 :] = _padded(times % np.uint64(10**9))
        data[:, self._stamps] = np.tile(stamp, self._count)
        moving = rows[np.ix_(due, self._columns)] * self._factors
        places, half = moving[:, : self._places], moving[:, self._places :]
        numbers = np.concatenate([places, np.sin(half), np.cos(half)], axis=1).astype("<f8", copy=False)
        data[:, self._numbers] = numbers.view(np.uint8)
        return times, data


def _transform(frame: Frame) -> tuple[bytes, int, list[int]]:
    """Return a `FrameTransform`, where its timestamp's content begins, and where the numbers of `POSE` begin."""
    parent, child = frame.parent.encode(), frame.name.encode()
    message = bytearray(b"\x0a" + varint(2 * (VARINT + 1)) + b"\x08")  # timestamp: seconds
    stamp = len(message)
    message += bytes(VARINT) + NANOS + bytes(VARINT)
    message += b"\x12" + varint(len(parent)) + parent + b"\x1a" + varint(len(child)) + child
    pose = [0.0 if isinstance(place, Column) else place for place in frame.place] + [0.0, 0.0, 0.0, 1.0]
    numbers = []
    for tag, values in ((b"\x22", pose[:3]), (b"\x2a", pose[3:])):  # translation, rotation
        message += tag + varint(9 * len(values))
        for number, value in enumerate(values, 1):
            message += bytes([number << 3 | 1])
            numbers.append(len(message))
            message += struct.pack("<d", value)
    return bytes(message), stamp, numbers


def _padded(values: NDArray[np.uint64]) -> NDArray[np.uint8]:
    """Return numbers (n,) as varints of `VARINT` bytes each."""
    shifts = 7 * np.arange(VARINT, dtype=np.uint64)
    groups = (values[:, None] >> shifts & np.uint64(0x7F)).astype(np.uint8)
    groups[:, :-1] |= 0x80
    return groups


def _schema() -> bytes:
    kind = FieldDescriptorProto
    timestamp = FileDescriptorProto()
    TIMESTAMP_FILE.CopyToProto(timestamp)

    def message(name: str, *fields: tuple[str, str], repeated: bool = False) -> DescriptorProto:
        label = kind.LABEL_REPEATED if repeated else kind.LABEL_OPTIONAL
        found = DescriptorProto(name=name)
        for number, (field, of) in enumerate(fields, 1):
            plain = {"double": kind.TYPE_DOUBLE, "string": kind.TYPE_STRING}.get(of)
            made = kind(name=field, number=number, type=plain or kind.TYPE_MESSAGE, label=label)
            if plain is None:
                made.type_name = of
            found.field.append(made)
        return found

    numbers = [(name, "double") for name in "xyzw"]
    transform = message(
        "FrameTransform",
        ("timestamp", ".google.protobuf.Timestamp"),
        ("parent_frame_id", "string"),
        ("child_frame_id", "string"),
        ("translation", ".foxglove.Vector3"),
        ("rotation", ".foxglove.Quaternion"),
    )
    file = FileDescriptorProto(
        name="foxglove/FrameTransforms.proto",
        package="foxglove",
        syntax="proto3",
        dependency=[timestamp.name],
        message_type=[
            message("Vector3", *numbers[:3]),
            message("Quaternion", *numbers),
            transform,
            message("FrameTransforms", ("transforms", ".foxglove.FrameTransform"), repeated=True),
        ],
    )
    data: bytes = FileDescriptorSet(file=[timestamp, file]).SerializeToString(deterministic=True)
    return data
