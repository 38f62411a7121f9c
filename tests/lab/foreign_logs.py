"""Small MCAP files as other people's programs write them."""

import json

from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass
from google.protobuf.text_format import Parse
from mcap.writer import Writer
from mcap_ros2.writer import Writer as Ros2Writer

START = 1_700_000_000_000_000_000
"""Time of the first message in ns since 1970, as on a real robot."""

JOINTS = Parse(
    """
    file { name: "vector.proto" package: "robot" syntax: "proto3"
      message_type { name: "Vector"
        field { name: "x" number: 1 type: TYPE_DOUBLE label: LABEL_OPTIONAL }
        field { name: "y" number: 2 type: TYPE_FLOAT label: LABEL_OPTIONAL } } }
    file { name: "joints.proto" package: "robot" syntax: "proto3" dependency: "vector.proto"
      message_type { name: "Joints"
        field { name: "ticks" number: 1 type: TYPE_INT32 label: LABEL_REPEATED }
        field { name: "force" number: 2 type: TYPE_MESSAGE type_name: ".robot.Vector" label: LABEL_OPTIONAL }
        field { name: "on" number: 3 type: TYPE_BOOL label: LABEL_OPTIONAL }
        field { name: "label" number: 4 type: TYPE_STRING label: LABEL_OPTIONAL } } }
    """,
    FileDescriptorSet(),
)

IMU = """\
# a sensor
std_msgs/Header header
geometry_msgs/Vector3 angular_velocity
geometry_msgs/Vector3 linear_acceleration
float64[9] covariance
uint8 UNKNOWN=0
bool[] flags
int16 level 7
geometry_msgs/Vector3[<=3] points
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


def write_json(path, topics):
    """Write topics, each with its (time in ns after the start, content) in turn."""
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        for topic, messages in topics.items():
            channel = writer.register_channel(topic, "json", 0)
            for time, content in messages:
                data = content if isinstance(content, bytes) else json.dumps(content).encode()
                writer.add_message(channel, START + time, data, START + time)
        writer.finish()
    return path


def write_protobuf(path, messages, schema=None):
    """Write (time in ns, text of a Joints message) on /joints; the files of the schema lie in the wrong order."""
    pool = DescriptorPool()
    for file in JOINTS.file:
        pool.Add(file)
    made = GetMessageClass(pool.FindMessageTypeByName("robot.Joints"))
    shuffled = FileDescriptorSet(file=list(reversed(JOINTS.file))).SerializeToString()
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        channel = writer.register_channel(
            "/joints", "protobuf", writer.register_schema("robot.Joints", "protobuf", schema or shuffled)
        )
        for time, text in messages:
            writer.add_message(channel, START + time, Parse(text, made()).SerializeToString(), START + time)
        writer.finish()
    return path


def write_ros2(path, messages):
    """Write (time in ns, content) as sensor messages on /imu/data."""
    with path.open("wb") as stream, Ros2Writer(stream) as writer:
        schema = writer.register_msgdef("sensor_msgs/msg/Imu", IMU)
        for time, content in messages:
            writer.write_message("/imu/data", schema, content, START + time, START + time)
    return path
