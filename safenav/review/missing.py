"""Actions that a team lacks for all obstacles that it must resolve. A run names only the obstacle
at which it ends, although others may be behind it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable

from msgspec import Struct
from msgspec.structs import replace

from safenav.review.foresight import Foresight, foresee
from safenav.scenario.model import Obstacle, RobotModel, Scenario


class Missing(Struct, frozen=True):
    """``actions`` that one robot must have for needs of ``obstacles`` (``needs``: the number of the
    first such need of each). The needs require up to ``robots`` robots, possibly ``together``;
    ``have``: the robots of the team with these actions; ``models``: the models with them."""

    actions: tuple[str, ...]
    robots: int
    together: bool
    obstacles: tuple[Obstacle, ...]
    needs: tuple[int, ...]
    have: tuple[str, ...]
    models: tuple[str, ...]


def missing_actions(
    scenario: Scenario, seen: Foresight, encountered: Collection[str], models: Iterable[RobotModel]
) -> tuple[Missing, ...]:
    """Return the missing actions for a minimal set of obstacles that must be resolved, with as many
    ``encountered`` ones as possible, in the scenario's order. ``seen``: the scenario's
    foresight."""
    found: dict[tuple[str, ...], Missing] = {}
    known = tuple(models)
    for obstacle in _needed(scenario, seen, encountered):
        for number, need in enumerate(obstacle.needs):
            skills = obstacle.type.actions(number)
            able = tuple(robot.name for robot in scenario.robots if skills <= robot.capabilities)
            if len(able) >= need.robots or any(
                skills < {*key} and obstacle in other.obstacles for key, other in found.items()
            ):
                continue  # enough robots, or an earlier need requires more of the same ones
            key = tuple(sorted(skills))
            having = tuple(model.name for model in known if skills <= model.capabilities)
            one = found.get(key, Missing(key, 0, False, (), (), able, having))
            new = obstacle not in one.obstacles
            found[key] = replace(
                one,
                robots=max(one.robots, need.robots),
                together=one.together or need.together,
                obstacles=(*one.obstacles, obstacle) if new else one.obstacles,
                needs=(*one.needs, number) if new else one.needs,
            )
    return tuple(found.values())


def _needed(scenario: Scenario, seen: Foresight, encountered: Collection[str]) -> list[Obstacle]:
    """A minimal set of obstacles that must be resolved so that every robot can meet its
    objective."""
    never = {each.obstacle for each in seen.lacks}
    if not seen.stuck:  # obstacles given up by the run may have appeared during it
        return [o for o in scenario.obstacles if o.name in encountered]
    stays: set[str] = set()
    for name in sorted(never, key=lambda name: (name in encountered, name)):
        if not _stuck(scenario, never - stays - {name}):
            stays.add(name)
    return [o for o in scenario.obstacles if o.name in never - stays]


def _stuck(scenario: Scenario, removed: Collection[str]) -> bool:
    left = tuple(o for o in scenario.obstacles if o.name not in removed)
    return bool(foresee(replace(scenario, obstacles=left)).stuck)
