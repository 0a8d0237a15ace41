"""Messages of ROS as values: the text of their definition read, their bytes decoded by it.

Sources: the ROS 2 interface definition
(https://docs.ros.org/en/rolling/Concepts/Basic/About-Interfaces.html); OMG, DDS-XTypes 1.3, section
7.4.3, plain CDR, version 1: values are aligned to their own size, counted from behind a header of
four bytes, whose second states the order of bytes. ROS 1 (https://wiki.ros.org/msg) has no header
and no alignment, its values are little-endian, and its times are two numbers of 32 bits.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from flagdata.errors import CorruptError, InputError

_NUMBERS = {
    "bool": "?",
    "byte": "B",
    "char": "B",
    "octet": "B",
    "int8": "b",
    "uint8": "B",
    "int16": "h",
    "uint16": "H",
    "int32": "i",
    "uint32": "I",
    "int64": "q",
    "uint64": "Q",
    "float32": "f",
    "float64": "d",
}
_BYTES = frozenset({"byte", "char", "octet", "uint8"})
_FIELD = re.compile(r"^([\w/]+)(?:<=\d+)?(\[(?:<=)?[0-9]{0,18}\])?\s+(\w+)(?!\s*=)(?:\s+\S.*)?$")
_NOTHING = re.compile(
    r"\[0+\]"
)  # ROS 2 knows no such list; messages of no bytes could be without end
_CONSTANT = re.compile(r"^[\w/]+(?:<=\d+)?\s+\w+\s*=")
_BUILT_IN = {
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec",
    "builtin_interfaces/Duration": "int32 sec\nuint32 nanosec",
}
_ROS_1 = {
    "builtin_interfaces/time": "uint32 sec\nuint32 nanosec",
    "builtin_interfaces/duration": "int32 sec\nint32 nanosec",
}
_TIMES = frozenset({"time", "duration"})  # of ROS 1
_ZSTD = b"\x28\xb5\x2f\xfd"
_DEEPEST = 32  # messages within messages


@dataclass(frozen=True, kw_only=True)
class _Field:
    """A field: its type, and how many there are: one (`None`), so many, or a sequence of any length
    (-1)."""

    name: str
    type: str
    count: int | None


def decoder(
    name: str, definition: str, *, ros1: bool = False
) -> Callable[[bytes], Mapping[str, Any]]:
    """Builds what decodes messages of a type: to field → number, text, bytes (of uint8 arrays),
    list or mapping.

    Args:
        name: of the type, as "sensor_msgs/msg/Image".
        definition: its text, and behind lines of "=" those of the types that it uses.
        ros1: whether the messages are of ROS 1.

    Raises:
        InputError: a definition that cannot be read, or one that uses a type which it does not
            define.
    """
    first, *further = re.split(r"^=+\s*$", definition, flags=re.MULTILINE)
    texts = {**_BUILT_IN, **(_ROS_1 if ros1 else {})}
    for section in further:
        head, _, text = section.strip().partition("\n")
        texts[_plain(head.removeprefix("MSG:").strip())] = text
    root = _plain(name)
    texts[root] = first
    types: dict[str, list[_Field]] = {}
    waiting = [root]
    while waiting:
        kind_name = waiting.pop()
        if kind_name not in types:
            if kind_name not in texts:
                raise InputError(
                    f"the definition of {name} uses {kind_name} and does not define it",
                    fix="record it anew",
                )
            types[kind_name] = _fields(texts[kind_name], package=kind_name.rpartition("/")[0])
            if ros1 and not types[kind_name]:  # lists of messages of no bytes could be without end
                raise InputError(
                    f"the definition of {name} has a part {kind_name} without fields",
                    fix="choose another topic",
                )
            waiting += [
                field.type
                for field in types[kind_name]
                if field.type not in _NUMBERS and field.type != "string"
            ]
    return lambda data: _Reader(data, types, name, ros1=ros1).whole(root)


def _plain(name: str) -> str:
    return name.replace("/msg/", "/")


def _fields(text: str, *, package: str) -> list[_Field]:
    fields: list[_Field] = []
    for line in text.splitlines():
        line = line.partition("#")[0].strip()
        if not line or _CONSTANT.match(line):
            continue
        match = _FIELD.match(line)
        if match is None or match[1] == "wstring" or _NOTHING.fullmatch(match[2] or ""):
            raise InputError(
                f"a line of a ROS definition cannot be read: {line!r}",
                fix="convert the topic to JSON",
            )
        kind, brackets = match[1], match[2]
        if kind not in _NUMBERS and kind != "string":
            kind = "std_msgs/Header" if kind == "Header" else _plain(kind)
            kind = f"builtin_interfaces/{kind}" if kind in _TIMES else kind
            kind = kind if "/" in kind else f"{package}/{kind}"
        count = (
            None
            if brackets is None
            else -1
            if brackets == "[]" or "<" in brackets
            else int(brackets[1:-1])
        )
        fields.append(_Field(name=match[3], type=kind, count=count))
    return fields


class _Reader:
    """The values of one message, in the order of its bytes."""

    def __init__(
        self, data: bytes, types: Mapping[str, list[_Field]], name: str, *, ros1: bool
    ) -> None:
        if not ros1 and data.startswith(_ZSTD):
            raise InputError(
                f"messages of {name} are compressed one by one, as by `ros2 bag record "
                "--compression-mode message`",
                fix="write the bag anew without compression: ros2 bag convert",
            )
        if not ros1 and (len(data) < 4 or data[0] != 0 or data[1] not in (0, 1)):
            raise CorruptError(
                f"a message of {name} is no plain CDR", fix="record it with the usual middleware"
            )
        self._data = memoryview(data) if ros1 else memoryview(data)[4:]
        self._order = "<" if ros1 or data[1] == 1 else ">"
        self._aligned = not ros1
        self._at = 0
        self._types = types
        self._name = name

    def whole(self, kind: str, depth: int = 0) -> dict[str, Any]:
        if depth > _DEEPEST:
            raise InputError(
                f"messages of {self._name} lie deeper than {_DEEPEST}",
                fix="convert the topic to JSON",
            )
        fields = self._types[kind]
        if not fields and self._aligned:
            self._take(1)  # ROS 2 gives an empty message one byte
        return {field.name: self._field(field, depth) for field in fields}

    def _field(self, field: _Field, depth: int) -> Any:
        if field.count is None:
            return self._value(field.type, depth)
        count = self._value("uint32", depth) if field.count < 0 else field.count
        if field.type in _BYTES:
            return bytes(self._take(count))
        if field.type in _NUMBERS:
            kind = np.dtype(self._order + _NUMBERS[field.type])
            if count:
                self._align(kind.itemsize)
            return np.frombuffer(self._take(count * kind.itemsize), kind).tolist()
        if count > len(self._data):
            raise self._cut_off()
        return [self._value(field.type, depth) for _ in range(count)]

    def _value(self, kind: str, depth: int) -> Any:
        if kind in _NUMBERS:
            code = struct.Struct(self._order + _NUMBERS[kind])
            self._align(code.size)
            return code.unpack(self._take(code.size))[0]
        if kind == "string":
            text = bytes(self._take(self._value("uint32", depth)))
            return text.rstrip(b"\0").decode(errors="replace")
        return self.whole(kind, depth + 1)

    def _align(self, size: int) -> None:
        if self._aligned:
            self._at += -self._at % size

    def _take(self, size: int) -> memoryview:
        taken = self._data[self._at : self._at + size]
        if len(taken) < size:
            raise self._cut_off()
        self._at += size
        return taken

    def _cut_off(self) -> CorruptError:
        return CorruptError(
            f"a message of {self._name} ends too soon",
            fix="record it anew, or choose another topic",
        )
