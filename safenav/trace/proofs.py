"""Infeasibility proofs in the form of a trace (docs/trace.md, "Proofs"): typed data, no logic.

Obstacles and robots are named; poses are places, a region and a heading (null without).
"""

from __future__ import annotations

from collections.abc import Mapping

from msgspec import Struct

from safenav.bounds import Count, Place, Sha256


class Reach(Struct, frozen=True):
    """``poses``: all that a robot can reach, ascending. ``live``: whether from some of them it can
    meet every target of its objective infinitely often."""

    poses: tuple[Place, ...]
    live: bool


class Closure(Struct, frozen=True, tag_field="kind", tag="closure"):
    """The most that the team can do. ``resolved``: the open obstacles that it can resolve;
    ``never``: those that it cannot; ``robots``: the reach of each robot without the former."""

    resolved: tuple[str, ...]
    never: tuple[str, ...]
    robots: Mapping[str, Reach]


class Option(Struct, frozen=True):
    """``robots`` fulfil need number ``need`` of ``obstacle``. ``lossless``: each of them can return
    to all poses that it could reach before, so that no other option need be examined."""

    obstacle: str
    need: Count
    robots: tuple[str, ...]
    lossless: bool


class Choice(Struct, frozen=True):
    """A possible next step, and the proof that it does not help."""

    option: Option
    proof: Proof


class Tree(Struct, frozen=True, tag_field="kind", tag="tree"):
    """All options (or one that is lossless), each refuted."""

    choices: tuple[Choice, ...]


class JointGoal(Struct, frozen=True):
    """Number of times that each robot would have to meet its objective."""

    rounds: Count


class JointSearch(Struct, frozen=True, tag_field="kind", tag="joint"):
    """No order of moves completes the mission: ``states`` joint states can be reached, whose sorted
    lines have this ``sha256``. ``start``: the pose of each robot; ``stages``: the next need of each
    open obstacle; ``memory``: what the formulas of some robots remember there, which the search
    follows."""

    robots: tuple[str, ...]
    start: Mapping[str, Place]
    stages: Mapping[str, Count]
    goal: JointGoal
    states: Count
    sha256: Sha256
    memory: Mapping[str, Mapping[str, int]] | None = None


class NoRoom(Struct, frozen=True, tag_field="kind", tag="room"):
    """Each of these ``robots`` must be at its last target at the end, each is in conflict with all
    others, and these targets are fewer regions than they are robots."""

    robots: tuple[str, ...]


Proof = Closure | Tree | JointSearch | NoRoom
