"""Every behaviour of a small team, by a program that shares nothing with the product: it is
compiled once from ``every_behaviour.cpp``, and reads its requests as numbers."""

import os
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path
from tempfile import gettempdir

from safenav.team.bound import BoundMoment

SOURCE = Path(__file__).with_suffix(".cpp")
MOST = 30_000_000
"""States of one question; what takes more stays without an answer."""


@dataclass(frozen=True)
class Truth:
    """``turns``: in which each obstacle can be resolved at the earliest (None: never); ``round``:
    in which all targets can be met."""

    turns: tuple[int | None, ...]
    round: int | None


def every_behaviour(
    moment: BoundMoment, walker: int = 0, targets: Sequence[Sequence[int]] = ()
) -> Truth | None:
    """What the team of ``moment`` can do; ``targets``: that one of the robots, ``walker``, is to
    meet one after the other. None: too many states."""
    talk = _program()
    assert talk.stdin is not None
    assert talk.stdout is not None
    found = [*_numbers(moment), walker, len(targets)]
    for target in targets:
        found += [len(target), *target]
    talk.stdin.write(" ".join(map(str, found)) + "\n")
    talk.stdin.flush()
    states, *turns, last = map(int, talk.stdout.readline().split())
    if states < 0:
        return None
    told = tuple(None if turn < 0 else turn for turn in turns)
    return Truth(told, None if last < 0 else last)


@cache
def _program() -> subprocess.Popen[str]:
    source = SOURCE.read_bytes()
    built = Path(gettempdir()) / f"every_behaviour_{os.getuid()}_{sha256(source).hexdigest()[:16]}"
    if not built.exists():
        mine = built.with_name(f"{built.name}.{os.getpid()}")
        compiler = os.environ.get("CXX", "c++")
        subprocess.run([compiler, "-O2", "-o", str(mine), str(SOURCE)], check=True)
        mine.replace(built)
    return subprocess.Popen([built], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def _numbers(moment: BoundMoment) -> list[int]:
    skills = sorted({need.action for one in moment.opens for need in one.gate.needs})

    def able(actions: frozenset[str]) -> int:
        return sum(1 << k for k, action in enumerate(skills) if action in actions)

    def team(members: frozenset[int]) -> int:
        return sum(1 << i for i in members)

    world = moment.walkers[0].graph.world
    begin = moment.now + 1
    found = [world.rows, world.cols, *(int(r in world.walls) for r in range(world.size))]
    found += [moment.count, len(moment.opens), begin, MOST]
    for i, walker in enumerate(moment.walkers):
        here = walker.pose if walker.leaves is None else walker.leaves
        base = begin // moment.count - (begin % moment.count <= i)
        left = 0 if walker.leaves is None else walker.ready - base
        found += [int(walker.graph.blocks > 1), walker.ticks]
        for pose in (here, walker.pose):
            face, region = divmod(pose, world.size)
            found += [region, face]
        found += [left, able(walker.capabilities)]
    for one in moment.opens:
        needs, stage = one.gate.needs, one.stage
        found += [one.gate.region, stage.need, team(stage.done)]
        found += [team(stage.group or frozenset()), len(needs)]
        for part, closed in zip(needs, one.gate.closed_to, strict=True):
            where = [region for region in range(world.size) if part.regions >> region & 1]
            found += [team(closed), able(part.skills), part.robots]
            found += [int(part.together), int(part.same), len(where), *where]
    return found
