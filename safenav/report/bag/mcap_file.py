"""Writer of messages into an MCAP file with the ROS 2 profile (extra ``mcap``).

Messages are encoded as plain CDR, little-endian: the encoder of the library takes most of a minute
for a run of 100,000 moves."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from safenav.extras import missing
from safenav.fleet.ros2.interfaces import INTERFACES
from safenav.report.bag.messages import Message, Stamped

Encoder = Callable[[bytearray, Any], None]
"""Appends a value, aligned; without one (None), a default."""

_NUMBERS = {"bool": "?", "byte": "B", "char": "B", "float32": "f", "float64": "d"}
_NUMBERS |= {"int8": "b", "int16": "h", "int32": "i", "int64": "q"}
_NUMBERS |= {"uint8": "B", "uint16": "H", "uint32": "I", "uint64": "Q"}


def write_mcap(path: Path, messages: Iterable[Stamped]) -> None:
    """Write the messages. Raises UsageError if the extra is not installed."""
    try:
        from mcap.writer import Writer
    except ImportError:
        raise missing("an MCAP file", "mcap", "mcap") from None
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2", library="safenav")
        schemas: dict[str, int] = {}
        channels: dict[str, int] = {}
        for number, message in enumerate(messages):
            kind, at = message.kind, round(message.seconds * 1e9)
            if kind not in schemas:
                schemas[kind] = writer.register_schema(kind, "ros2msg", definition(kind).encode())
            if message.topic not in channels:
                channels[message.topic] = writer.register_channel(
                    message.topic, "cdr", schemas[kind]
                )
            data = encoded(kind, message.message)
            writer.add_message(channels[message.topic], at, data, at, number)
        finish: Callable[[], None] = writer.finish
        finish()


def encoded(kind: str, message: Message) -> bytes:
    """Return a message (``nav_msgs/msg/Path``) as CDR; absent fields have their defaults."""
    out = bytearray()
    _encoder(kind.replace("/msg/", "/"))(out, message)
    return b"\0\1\0\0" + out  # the header of little-endian CDR, from which on values are aligned


@cache
def _encoder(kind: str) -> Encoder:
    """Return the encoder of a type of field: ``float64``, ``string[]``, ``geometry_msgs/Pose``."""
    base, sequence, count = kind.removesuffix("]").partition("[")
    if sequence:
        return _sequence(_encoder(base), int(count or 0))
    if base in _NUMBERS:
        return _number(struct.Struct(f"<{_NUMBERS[base]}"))
    if base == "string":
        return _string
    lines = [line.split() for line in INTERFACES[base]]
    if all(of == "float64" for of, _ in lines):
        return _numbers([key for _, key in lines])
    fields = [(key, _encoder(of)) for of, key in lines]

    def encode(out: bytearray, value: Any) -> None:
        value = value or {}
        for key, field in fields:
            field(out, value.get(key))

    return encode


def _number(form: struct.Struct) -> Encoder:
    size, pack = form.size, form.pack

    def encode(out: bytearray, value: Any) -> None:
        out += bytes(-len(out) % size)
        out += pack(value or 0)

    return encode


def _numbers(keys: Sequence[str]) -> Encoder:
    """Return the encoder of a type of 64-bit numbers only, of which bags are full."""
    pack = struct.Struct(f"<{len(keys)}d").pack

    def encode(out: bytearray, value: Any) -> None:
        out += bytes(-len(out) % 8)
        out += pack(*[value.get(key, 0.0) for key in keys] if value else [0.0] * len(keys))

    return encode


_length = _number(struct.Struct("<I"))


def _string(out: bytearray, value: Any) -> None:
    text = (value or "").encode() + b"\0"
    _length(out, len(text))
    out += text


def _sequence(item: Encoder, count: int) -> Encoder:
    """Return the encoder of an array of ``count`` items; 0: of any number."""

    def encode(out: bytearray, value: Any) -> None:
        values = value or [None] * count
        if not count:
            _length(out, len(values))
        for each in values:
            item(out, each)

    return encode


_SEPARATOR = "\n" + "=" * 80 + "\n"


def definition(kind: str) -> str:
    """Return the definition of a message (``nav_msgs/msg/Path``) and of all its parts."""
    wanted = [kind.replace("/msg/", "/")]
    for name in wanted:
        parts = (field.split()[0].removesuffix("[]") for field in INTERFACES[name])
        wanted += dict.fromkeys(part for part in parts if part in INTERFACES.keys() - wanted)
    first, *texts = ("\n".join(INTERFACES[name]) for name in wanted)
    named = (f"MSG: {name}\n{text}" for name, text in zip(wanted[1:], texts, strict=True))
    return _SEPARATOR.join((first, *named))
