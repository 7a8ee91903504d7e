"""The catalogue: which robot models and obstacle types there are, and where each comes from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace

from safenav.dataclass import dataclass
from safenav.scenario.model import ObstacleType, RobotModel


@dataclass(frozen=True)
class Catalogue:
    """Robot models and obstacle types by name.

    ``sources`` says where an entry comes from: ``robots.digit`` -> "built in" or a file.
    ``broken`` holds the names (and ``*`` for any) of entries that were reported as unusable:
    to call them unknown as well would only hide what is wrong.
    """

    robots: Mapping[str, RobotModel] = field(default_factory=dict)
    obstacles: Mapping[str, ObstacleType] = field(default_factory=dict)
    sources: Mapping[str, str] = field(default_factory=dict)
    broken: frozenset[str] = frozenset()

    @property
    def layers(self) -> frozenset[str]:
        return frozenset(model.layer for model in self.robots.values())

    def may_hold(self, name: str) -> bool:
        """Whether an entry that is not there may be one that could not be read."""
        return not self.broken.isdisjoint((name, "*"))

    def without_rest(self) -> Catalogue:
        """The same after more of it could not be read at all."""
        return replace(self, broken=self.broken | {"*"})
