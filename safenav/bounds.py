"""Bounded values: annotations that readers and schemas check."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

Region = int
Count = Annotated[int, Meta(ge=0)]
Positive = Annotated[int, Meta(ge=1)]
Seconds = Annotated[float, Meta(ge=0)]
Sha256 = Annotated[str, Meta(pattern="^[0-9a-f]{64}$", description="a sha256 (64 digits 0-9a-f)")]
Heading = Annotated[
    str, Meta(pattern="^(north|east|south|west)$", description="north, east, south or west")
]
Place = tuple[Region, Heading | None]
"""A region, and the heading of a robot that has one."""
