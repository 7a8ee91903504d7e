"""Glyphs of pictures, pages and the studio: marks of states and events, silhouettes of robots and
obstacles.

``glyphs.json`` holds SVG paths in [-1, 1] squared, y downwards, filled by the even-odd rule; shapes
repeat what colours show.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from msgspec import Struct, json

from safenav.run.values import ObstacleStatus, StoryKind


class Mark(Struct, frozen=True):
    """A glyph with its colour."""

    path: str
    colour: str


class Glyphs(Struct, frozen=True):
    """``nose`` shows a heading, pointing north, outside the body; ``charger`` a region where
    batteries are charged; ``plate`` is the background of a robot's silhouette; ``robots`` are
    silhouettes by model, ``obstacles`` by type, ``opened`` those of doors that are resolved."""

    nose: str
    charger: str
    plate: str
    robots: Mapping[str, str]
    obstacles: Mapping[str, str]
    opened: Mapping[str, str]
    status: Mapping[ObstacleStatus, Mark]
    events: Mapping[StoryKind, Mark]


GLYPHS = json.decode(Path(__file__).with_suffix(".json").read_bytes(), type=Glyphs)
STATUS_MARKS, EVENT_MARKS = GLYPHS.status, GLYPHS.events


def robot_pictogram(model: str) -> str:
    """Return the silhouette of a robot model; empty if none fits."""
    return _found(GLYPHS.robots, model)


def obstacle_pictogram(kind: str) -> str:
    """Return the silhouette of an obstacle type; empty if none fits."""
    return _found(GLYPHS.obstacles, kind)


def opened_pictogram(kind: str) -> str:
    """Return the silhouette of an obstacle type when it is resolved."""
    return _found(GLYPHS.opened, kind) or obstacle_pictogram(kind)


def _found(paths: Mapping[str, str], name: str) -> str:
    """Return the path of the longest known name that equals ``name``, or ends it after ``_`` or
    ``-`` (``fire_door``: that of ``door``); empty if there is none."""
    plain = name.replace("-", "_")
    fits = [known for known in paths if plain == known or plain.endswith(f"_{known}")]
    return paths[max(fits, key=len)] if fits else ""


def separated(places: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return offsets for each (row, col) so that robots over one another are drawn side by side.

    Grows smoothly as two robots come closer than one region, so that nothing jumps."""
    shifts = [(0.0, 0.0)] * len(places)
    for i, (row_a, col_a) in enumerate(places):
        for j in range(i + 1, len(places)):
            row_b, col_b = places[j]
            near = 1.0 - ((row_a - row_b) ** 2 + (col_a - col_b) ** 2) ** 0.5
            if near > 0:
                push = 0.21 * near
                shifts[i] = (shifts[i][0] + push, shifts[i][1] - push)
                shifts[j] = (shifts[j][0] - push, shifts[j][1] + push)
    return [(max(-0.24, min(0.24, r)), max(-0.24, min(0.24, c))) for r, c in shifts]
