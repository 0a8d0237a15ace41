"""Writes ros2.mcap beside it, by another program's encoder: `pip install mcap-ros2-support`, then
run this file.

Twelve messages a topic, one every 100 ms from noon, logged 5 ms late: a PNG of gray 50 + 5k, a
mono8 image of 200 - 5k with four bytes of padding a row, a pressure of 101325 + k Pa, and a type of
the writer's own with a wind.
"""

import io
from pathlib import Path

from mcap_ros2.writer import Writer
from PIL import Image

NOON, STEP, LATE = 1_777_636_800_000_000_000, 100_000_000, 5_000_000
HEADER = """
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
TYPES = {
    "/compressed": (
        "sensor_msgs/msg/CompressedImage",
        "std_msgs/Header header # the image's stamp\nstring format\nuint8[] data" + HEADER,
    ),
    "/image": (
        "sensor_msgs/msg/Image",
        "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 "
        "is_bigendian\nuint32 step\n"
        "uint8[] data" + HEADER,
    ),
    "/pressure": (
        "sensor_msgs/msg/FluidPressure",
        "std_msgs/Header header\nfloat64 fluid_pressure\nfloat64 variance" + HEADER,
    ),
    "/mast": (
        "field/msg/Mast",
        'uint8 SONIC=1\nstring NAME="a # b"\nstd_msgs/Header header\nbool sound\nuint8 kind 1\n'
        "Reading[<=2] readings\nfloat32[3] volts\nint16[] empty\nint64 last"
        + HEADER
        + "================================================================================\n"
        "MSG: field/Reading\nstring unit\nfloat64 speed\nfloat32 from_degrees\n",
    ),
}


def png(gray):
    buffer = io.BytesIO()
    Image.new("L", (64, 48), gray).save(buffer, "PNG")
    return buffer.getvalue()


def values(topic, k):
    at = NOON + k * STEP
    stamp = {"stamp": {"sec": at // 10**9, "nanosec": at % 10**9}, "frame_id": "odd"}
    if topic == "/compressed":
        return {"header": stamp, "format": "png", "data": png(50 + 5 * k)}
    if topic == "/image":
        row = bytes([200 - 5 * k]) * 64 + bytes(4)
        return {
            "header": stamp,
            "height": 48,
            "width": 64,
            "encoding": "mono8",
            "is_bigendian": 0,
            "step": 68,
            "data": row * 48,
        }
    if topic == "/pressure":
        return {"header": stamp, "fluid_pressure": 101325.0 + k, "variance": 0.0}
    speeds = [5 + (k * 3 % 7) / 2, 6 + (k * 5 % 7) / 4]
    readings = [{"unit": "m/s", "speed": speed, "from_degrees": 90.0 + k} for speed in speeds]
    return {
        "header": stamp,
        "sound": True,
        "kind": 1,
        "readings": readings,
        "volts": [1.5, 2.5, 3.5],
        "empty": [],
        "last": 2**40 + k,
    }


with Path(__file__).with_name("ros2.mcap").open("wb") as stream:
    writer = Writer(stream)
    schemas = {topic: writer.register_msgdef(name, text) for topic, (name, text) in TYPES.items()}
    for k in range(12):
        for topic, schema in schemas.items():
            at = NOON + k * STEP + LATE
            writer.write_message(topic, schema, values(topic, k), log_time=at, publish_time=at)
    writer.finish()
