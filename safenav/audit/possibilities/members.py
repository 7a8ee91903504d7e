"""Conversion of the members of a team, and of settlements, to the data of ``team``."""

from __future__ import annotations

from typing import NamedTuple

from safenav.audit.language import Pose
from safenav.audit.poses import PoseGraph, Poses

FAR = 1 << 30


class Act(NamedTuple):
    """``robots``, each in its pose, have their part in the next need of an obstacle, its need
    number ``need``."""

    obstacle: str
    need: int
    robots: dict[str, Pose]


class Member(NamedTuple):
    """A robot. ``steps``: from each pose to others, obstacles that stay left out; ``aims``: for
    each of its targets the poses where it is met; ``ticks``: of its slowest step; ``room``: the
    most loads that it can carry."""

    steps: PoseGraph
    aims: tuple[Poses, ...]
    rivals: frozenset[str] = frozenset()
    ticks: int = 1
    room: int = FAR


Sets = tuple[Poses, ...]  # poses that each robot may choose


class Step(NamedTuple):
    """The next need of the obstacle with that index, met by ``group``, each ``at`` some poses."""

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
    """``served``: obstacles that will be resolved; ``duties``: duty of each robot; ``early``: the
    duties to come for which robots set out now, since something is due."""

    served: tuple[str, ...]
    duties: dict[str, Duty]
    early: dict[str, Duty]
