"""A text that does not change, as `std_msgs/msg/String` (ROS 2, CDR): viewers look for a URDF in such a message."""

import struct

import numpy as np
from numpy.typing import NDArray


class TextChannel:
    """A channel with one message, at the first row."""

    message_encoding = "cdr"
    schema_name = "std_msgs/msg/String"
    schema_encoding = "ros2msg"
    schema = b"string data"

    def __init__(self, topic: str, text: str) -> None:
        self.topic = topic
        data = text.encode() + b"\0"
        self._message = np.frombuffer(b"\0\1\0\0" + struct.pack("<I", len(data)) + data, np.uint8)
        self._told = False

    def repeat(self) -> None:
        """Tell the text once more, at the next row."""
        self._told = False

    def messages(
        self, nanoseconds: NDArray[np.uint64], rows: NDArray[np.float64]
    ) -> tuple[NDArray[np.uint64], NDArray[np.uint8]]:
        """See `ExtraChannel.messages`."""
        count = 0 if self._told else min(1, len(rows))
        self._told |= count > 0
        return nanoseconds[:count], np.tile(self._message, (count, 1))
