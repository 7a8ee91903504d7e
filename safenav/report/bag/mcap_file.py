"""Writer of messages into an MCAP file with the ROS 2 profile (extra ``mcap``)."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from safenav.extras import missing
from safenav.report.bag.definitions import definition
from safenav.report.bag.messages import Stamped


def write_mcap(path: Path, messages: Iterable[Stamped]) -> int:
    """Write the messages, and return how many there were.

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
        for said in messages:
            if said.kind not in schemas:
                schemas[said.kind] = writer.register_msgdef(said.kind, definition(said.kind))
            nanoseconds = round(said.seconds * 1e9)
            schema = schemas[said.kind]
            writer.write_message(said.topic, schema, said.message, nanoseconds, nanoseconds)
            count += 1
        finish: Callable[[], None] = writer.finish
        finish()
    return count
