"""Marks of states and events: one set for the vector pictures and for the page.

Colours and paths are those of safenav/trace/looks.py; shapes repeat what colours show.
"""

from __future__ import annotations

from collections.abc import Sequence

from msgspec import Struct

from safenav.report.replay.timeline import ObstacleStatus, StoryKind
from safenav.trace.looks import BLUE, GREEN, GREY, VERMILLION

NOSE = "M-0.42,-1.12L0,-1.72L0.42,-1.12Z"
"""The mark that shows a heading, pointing north, outside the body."""


class Mark(Struct, frozen=True):
    """A glyph with its colour."""

    path: str
    colour: str


_WARNING = "M0,-0.95L1,0.8H-1ZM-0.13,-0.35L-0.07,0.28H0.07L0.13,-0.35ZM-0.12,0.4V0.62H0.12V0.4Z"
_BUBBLE = (
    "M-0.95,-0.8H0.95V0.42H-0.05L-0.5,0.9V0.42H-0.95Z"
    "M-0.62,-0.32V-0.06H-0.36V-0.32ZM-0.13,-0.32V-0.06H0.13V-0.32ZM0.36,-0.32V-0.06H0.62V-0.32Z"
)
_CHECK = "M-0.9,0.08L-0.6,-0.22L-0.22,0.16L0.6,-0.68L0.9,-0.38L-0.22,0.76Z"
_SALTIRE = (
    "M-0.85,-0.55L-0.55,-0.85L0,-0.3L0.55,-0.85L0.85,-0.55L0.3,0L0.85,0.55"
    "L0.55,0.85L0,0.3L-0.55,0.85L-0.85,0.55L-0.3,0Z"
)
_HOURGLASS = "M-0.65,-0.95H0.65V-0.6L0.15,0L0.65,0.6V0.95H-0.65V0.6L-0.15,0L-0.65,-0.6Z"
_RING = (
    "M0.8,0A0.8,0.8 0 1 1 -0.8,0A0.8,0.8 0 1 1 0.8,0Z"
    "M0.5,0A0.5,0.5 0 1 0 -0.5,0A0.5,0.5 0 1 0 0.5,0Z"
)

STATUS_MARKS = {
    ObstacleStatus.HIDDEN: Mark(_RING, GREY),
    ObstacleStatus.FOUND: Mark(_WARNING, VERMILLION),
    ObstacleStatus.REQUESTED: Mark(_BUBBLE, "#B87900"),
    ObstacleStatus.RESOLVED: Mark(_CHECK, GREEN),
    ObstacleStatus.BLOCKED: Mark(_SALTIRE, "#3B4048"),
}

EVENT_MARKS = {
    StoryKind.VIOLATION: Mark(_WARNING, VERMILLION),
    StoryKind.REQUEST: Mark(_BUBBLE, "#B87900"),
    StoryKind.PUSH: Mark(
        "M-0.8,-0.9H0.8V-0.6H-0.8ZM-0.25,-0.4H0.25V0.1H0.75L0,0.9L-0.75,0.1H-0.25Z", BLUE
    ),
    StoryKind.POP: Mark(
        "M-0.8,0.6H0.8V0.9H-0.8ZM-0.25,0.4H0.25V-0.1H0.75L0,-0.9L-0.75,-0.1H-0.25Z", BLUE
    ),
    StoryKind.SYNTHESIS: Mark(
        "M-0.5,-0.87H0.5L1,0L0.5,0.87H-0.5L-1,0ZM0.4,0A0.4,0.4 0 1 0 -0.4,0A0.4,0.4 0 1 0 0.4,0Z",
        "#A5568A",
    ),
    StoryKind.ACT: Mark(  # an arrow against a bar
        "M-0.95,-0.2H-0.1V-0.65L0.55,0L-0.1,0.65V0.2H-0.95ZM0.65,-0.9H0.95V0.9H0.65Z", GREEN
    ),
    StoryKind.RESOLVED: Mark(_CHECK, GREEN),
    StoryKind.BLOCKED: Mark(_SALTIRE, "#5C6470"),
    StoryKind.GOAL: Mark("M-0.65,-0.95H-0.4V-0.85L0.75,-0.4L-0.4,0.05V0.95H-0.65Z", GREY),
    StoryKind.ASSUMPTION: Mark(
        "M0,-1L1,0L0,1L-1,0ZM-0.11,-0.5V0.15H0.11V-0.5ZM-0.11,0.3V0.52H0.11V0.3Z", VERMILLION
    ),
    StoryKind.OUTCOME: Mark("M-0.75,-0.75H0.75V0.75H-0.75Z", GREY),
    StoryKind.APPEARED: Mark(
        "M-0.2,-0.9H0.2V-0.2H0.9V0.2H0.2V0.9H-0.2V0.2H-0.9V-0.2H-0.2Z", VERMILLION
    ),
    StoryKind.GONE: Mark("M-0.9,-0.2H0.9V0.2H-0.9Z", GREEN),
    StoryKind.TRUTH: Mark("M0,-0.95A0.95,0.95 0 0 1 0,0.95ZM-0.25,-0.8V0.8H-0.6V-0.8Z", VERMILLION),
    StoryKind.INPUTS: Mark(  # a bell
        "M-0.6,0.3V-0.35A0.6,0.6 0 0 1 0.6,-0.35V0.3L0.9,0.6H-0.9ZM-0.25,0.72H0.25L0,0.97Z",
        VERMILLION,
    ),
    StoryKind.OBJECTIVE: Mark(
        "M-0.9,-0.25H0.2V-0.7L0.95,0L0.2,0.7V0.25H-0.9ZM-0.9,-0.95H-0.55V-0.4H-0.9Z", VERMILLION
    ),
    StoryKind.SERVICE: Mark("M-0.65,-0.85H-0.2V0.85H-0.65ZM0.2,-0.85H0.65V0.85H0.2Z", VERMILLION),
    StoryKind.PLAN: Mark(
        "M-0.9,-0.6H0.2V-0.95L0.9,-0.4L0.2,0.15V-0.2H-0.9ZM-0.9,0.4H0.9V0.75H-0.9Z", BLUE
    ),
    StoryKind.PLAN_END: Mark("M-0.9,0.4H0.9V0.75H-0.9Z", BLUE),
    StoryKind.REOPENED: Mark(_RING, VERMILLION),
    StoryKind.FAILURE: Mark("M0.35,-0.95L-0.65,0.2H-0.05L-0.35,0.95L0.65,-0.25H0.05Z", VERMILLION),
    StoryKind.DEADLINE: Mark(  # a clock
        "M0,-0.95A0.95,0.95 0 1 1 0,0.95A0.95,0.95 0 1 1 0,-0.95Z"
        "M-0.12,-0.65H0.12V-0.05L0.5,0.33L0.33,0.5L-0.12,0.05Z",
        VERMILLION,
    ),
    StoryKind.WAITING: Mark(_HOURGLASS, VERMILLION),
    StoryKind.PAUSED: Mark(_HOURGLASS, GREY),
    StoryKind.OPERATOR: Mark(
        "M0,-0.95A0.4,0.4 0 1 1 0,-0.15A0.4,0.4 0 1 1 0,-0.95Z"
        "M-0.75,0.95A0.75,0.85 0 0 1 0.75,0.95Z",
        BLUE,
    ),
}


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
