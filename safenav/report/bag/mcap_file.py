"""Writer of messages into an MCAP file with the ROS 2 profile (extra ``mcap``)."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from safenav.extras import missing
from safenav.fleet.ros2.interfaces import INTERFACES
from safenav.report.bag.messages import Stamped


def write_mcap(path: Path, messages: Iterable[Stamped]) -> int:
    """Write the messages, and return their number.

    Raises UsageError if the extra is not installed.
    """
    try:
        from mcap_ros2.writer import Writer
    except ImportError:
        raise missing("an MCAP file", "mcap-ros2-support", "mcap") from None
    count = 0
    with path.open("wb") as file:
        writer = Writer(file)
        schemas = {}
        for message in messages:
            kind, at = message.kind, round(message.seconds * 1e9)
            if kind not in schemas:
                schemas[kind] = writer.register_msgdef(kind, definition(kind))
            writer.write_message(message.topic, schemas[kind], message.message, at, at)
            count += 1
        finish: Callable[[], None] = writer.finish
        finish()
    return count


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
