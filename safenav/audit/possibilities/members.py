"""Data of ``team``: the members of a team, duties and settlements."""

from __future__ import annotations

from typing import NamedTuple

from safenav.audit.poses import PoseGraph, Poses

FAR = 1 << 30


class Member(NamedTuple):
    """A robot. ``steps``: from each pose to others, outside permanent obstacles; ``aims``: the
    poses where each of its targets is met; ``ticks``: duration of a step; ``laden``: it
    carries a load that no robot can ever put down."""

    steps: PoseGraph
    aims: tuple[Poses, ...]
    rivals: frozenset[str] = frozenset()
    ticks: int = 1
    laden: bool = False


Sets = tuple[Poses, ...]  # the possible poses of each robot


class Step(NamedTuple):
    """The next need of the obstacle with that index, met by ``group``; ``at``: the possible poses
    of each of its robots."""

    obstacle: int
    group: tuple[str, ...]
    at: tuple[Poses, ...]
    lossless: bool


class Duty(NamedTuple):
    """``robot`` serves an obstacle, with ``group``, in one of ``regions``."""

    obstacle: str
    group: tuple[str, ...]
    regions: frozenset[int]
    stays: bool


class Settlement(NamedTuple):
    """``served``: obstacles that will be resolved; ``duties``: duty of each robot."""

    served: tuple[str, ...]
    duties: dict[str, Duty]
