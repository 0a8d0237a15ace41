"""The protobuf messages of a record: Foxglove's for pictures, our own for wind and parameters,
built without protoc.

Field numbers are a promise to files already written: a number is never reused and never changes its
meaning. Every field's comment, unit and convention travels inside the file, in the schema's
FileDescriptorSet.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.CompressedVideo_pb2 import CompressedVideo
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory, timestamp_pb2
from google.protobuf.message import Message

from flagdata.core.schema import CHANNELS
from flagdata.errors import CorruptError
from flagdata.timebase import NANOSECONDS

__all__ = [
    "WIND_FIELDS",
    "CompressedImage",
    "CompressedVideo",
    "TruthParameters",
    "WindMean",
    "WindSample",
    "data_field",
    "descriptor_set",
    "payload",
    "set_timestamp",
    "timestamp_of",
]

# channel of schema.CHANNELS → (field name in WindSample, field number)
WIND_FIELDS: dict[str, tuple[str, int]] = {
    "wind_speed": ("speed", 2),
    "wind_direction": ("direction", 3),
    "wind_direction_magnetic": ("direction_magnetic", 4),
    "apparent_wind_speed": ("apparent_speed", 5),
    "apparent_wind_direction": ("apparent_direction", 6),
    "wind_x": ("wind_x", 7),
    "wind_y": ("wind_y", 8),
    "wind_z": ("wind_z", 9),
    "air_temperature": ("air_temperature", 10),
    "air_pressure": ("air_pressure", 11),
    "relative_humidity": ("relative_humidity", 12),
    "platform_speed": ("platform_speed", 13),
    "platform_heading": ("platform_heading", 14),
    "theoretical_wind_speed": ("theoretical_speed", 15),
    "theoretical_wind_direction": ("theoretical_direction", 16),
    "wind_speed_estimate": ("speed_estimate", 17),
    "tracked_rms": ("tracked_rms", 18),
    "tracked_points": ("tracked_points", 19),
    "tracking_quality": ("tracking_quality", 20),
    "flutter_frequency": ("flutter_frequency", 21),
    "deflection_angle": ("deflection_angle", 22),
    "sonic_temperature": ("sonic_temperature", 23),
}
_FLAGS_NUMBER = 100
_HOST_TIME_NUMBER = 101
_TIMESTAMP = ".google.protobuf.Timestamp"
_FIELD = descriptor_pb2.FieldDescriptorProto
_FILE = "flagdata/record.proto"


class _Sheet:
    """One message under construction; remembers the comments for the file's source information."""

    def __init__(self, file: descriptor_pb2.FileDescriptorProto, name: str, about: str) -> None:
        self._file = file
        self._path = [4, len(file.message_type)]
        self._message = file.message_type.add(name=name)
        self._comment([], about)

    def _comment(self, tail: list[int], text: str) -> None:
        self._file.source_code_info.location.add(
            path=self._path + tail, leading_comments=f" {text}\n"
        )

    def field(
        self, name: str, number: int, kind: int, about: str, *, type_name: str | None = None
    ) -> None:
        """Adds a field without presence: its zero value is not written."""
        self._add(name, number, kind, about, type_name, _FIELD.LABEL_OPTIONAL)

    def repeated(
        self, name: str, number: int, kind: int, about: str, *, type_name: str | None = None
    ) -> None:
        self._add(name, number, kind, about, type_name, _FIELD.LABEL_REPEATED)

    def optional(self, name: str, number: int, kind: int, about: str) -> None:
        """Adds a field whose absence differs from zero (proto3 `optional`: a synthetic oneof)."""
        field = self._add(name, number, kind, about, None, _FIELD.LABEL_OPTIONAL)
        field.proto3_optional = True
        field.oneof_index = len(self._message.oneof_decl)
        self._message.oneof_decl.add(name=f"_{name}")

    def _add(
        self, name: str, number: int, kind: int, about: str, type_name: str | None, label: int
    ) -> descriptor_pb2.FieldDescriptorProto:
        self._comment([2, len(self._message.field)], about)
        field = self._message.field.add(name=name, number=number)
        field.type = kind  # pyright: ignore[reportAttributeAccessIssue]
        field.label = label  # pyright: ignore[reportAttributeAccessIssue]
        if type_name:
            field.type_name = type_name
        return field


def _build() -> descriptor_pb2.FileDescriptorProto:
    file = descriptor_pb2.FileDescriptorProto(name=_FILE, package="flagdata", syntax="proto3")
    file.dependency.append("google/protobuf/timestamp.proto")

    sample = _Sheet(
        file, "WindSample", "One sample of an anemometer. A field that is absent was not measured."
    )
    sample.field(
        "timestamp",
        1,
        _FIELD.TYPE_MESSAGE,
        "Instant on the record's common clock.",
        type_name=_TIMESTAMP,
    )
    for channel, (name, number) in WIND_FIELDS.items():
        about = CHANNELS[channel]
        frame = f"; {about.frame}" if about.frame else ""
        sample.optional(
            name,
            number,
            _FIELD.TYPE_DOUBLE,
            f"{about.about} [{about.unit}{frame}]; NaN where missing.",
        )
    sample.field(
        "flags",
        _FLAGS_NUMBER,
        _FIELD.TYPE_UINT32,
        "Bits of flagdata.core.schema.SampleFlag; 0 is sound.",
    )
    sample.field(
        "host_time",
        _HOST_TIME_NUMBER,
        _FIELD.TYPE_MESSAGE,
        "The logging computer's own clock.",
        type_name=_TIMESTAMP,
    )

    mean = _Sheet(file, "WindMean", "Mean of the usable samples of one period.")
    mean.field(
        "timestamp",
        1,
        _FIELD.TYPE_MESSAGE,
        "END of the period, on the common clock.",
        type_name=_TIMESTAMP,
    )
    mean.field("speed", 2, _FIELD.TYPE_DOUBLE, "Mean wind speed [m/s].")
    mean.field("sigma", 3, _FIELD.TYPE_DOUBLE, "Standard uncertainty of that mean [m/s].")
    mean.field(
        "direction",
        4,
        _FIELD.TYPE_DOUBLE,
        "Vector-mean direction [rad; from, clockwise from true north]; NaN where the sensor has "
        "none.",
    )
    mean.field("count", 5, _FIELD.TYPE_INT32, "Usable samples in the period.")
    mean.field("period", 6, _FIELD.TYPE_DOUBLE, "Length of the period [s].")

    parameter = _Sheet(file, "Parameter", "One number by its name.")
    parameter.field("name", 1, _FIELD.TYPE_STRING, "Name in the parameter table.")
    parameter.field("value", 2, _FIELD.TYPE_DOUBLE, "Value in the SI unit of that name.")
    truth = _Sheet(file, "TruthParameters", "What a simulated record was made with.")
    truth.field(
        "timestamp", 1, _FIELD.TYPE_MESSAGE, "Instant on the common clock.", type_name=_TIMESTAMP
    )
    truth.repeated(
        "parameters", 2, _FIELD.TYPE_MESSAGE, "Sorted by name.", type_name=".flagdata.Parameter"
    )
    return file


_FILE_PROTO = _build()
_POOL = descriptor_pool.DescriptorPool()
_POOL.AddSerializedFile(timestamp_pb2.DESCRIPTOR.serialized_pb)
_POOL.AddSerializedFile(_FILE_PROTO.SerializeToString())


def _message_class(name: str) -> type[Message]:
    return message_factory.GetMessageClass(_POOL.FindMessageTypeByName(f"flagdata.{name}"))


# Built at run time, so their fields are unknown to the type checker.
WindSample: Any = _message_class("WindSample")
WindMean: Any = _message_class("WindMean")
TruthParameters: Any = _message_class("TruthParameters")


def descriptor_set(message: Any) -> bytes:
    """Returns the FileDescriptorSet an MCAP schema embeds for a message class, dependencies first;
    our own with comments."""
    files = descriptor_pb2.FileDescriptorSet()
    added: set[str] = set()

    def visit(file: Any) -> None:
        if file.name in added:
            return
        added.add(file.name)
        for dependency in file.dependencies:
            visit(dependency)
        if file.name == _FILE:
            files.file.add().CopyFrom(_FILE_PROTO)
        else:
            file.CopyToProto(files.file.add())

    visit(message.DESCRIPTOR.file)
    return files.SerializeToString(deterministic=True)


def set_timestamp(stamp: Any, instant: int) -> None:
    """Write UTC nanoseconds into a google.protobuf.Timestamp."""
    stamp.seconds, stamp.nanos = divmod(int(instant), NANOSECONDS)


def timestamp_of(stamp: Any) -> int:
    """Converts a google.protobuf.Timestamp to UTC nanoseconds."""
    return stamp.seconds * NANOSECONDS + stamp.nanos


def _varint(data: bytes | memoryview, at: int) -> tuple[int, int]:
    value = shift = 0
    while True:
        byte = data[at]
        at += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, at
        shift += 7
        if shift > 63:
            raise CorruptError(
                "a protobuf varint has more than ten bytes", fix="run flagdata verify"
            )


_FIXED: Mapping[int, int] = {1: 8, 5: 4}


def data_field(kind: Any) -> int:
    """Returns the number of the field `data` of CompressedImage or CompressedVideo (it differs)."""
    return kind.DESCRIPTOR.fields_by_name["data"].number


def payload(message: memoryview, *, field: int) -> memoryview:
    """Finds the bytes of one length-delimited field of a protobuf message, without a copy.

    Raises:
        CorruptError: not a protobuf message, without that field, or a length that leads out of it.
    """
    at, end = 0, len(message)
    data: memoryview | None = None
    try:
        while at < end:
            tag, at = _varint(message, at)
            wire = tag & 7
            if wire == 2:
                length, at = _varint(message, at)
                if at + length > end:
                    break
                if tag >> 3 == field:
                    data = message[at : at + length]
                at += length
            elif wire == 0:
                _, at = _varint(message, at)
            elif wire in _FIXED:
                at += _FIXED[wire]
            else:
                break
        else:
            if data is not None and at == end:
                return data
    except IndexError:
        pass
    raise CorruptError(
        f"a frame's message is not a protobuf with bytes in field {field}",
        fix="run flagdata verify",
    )
