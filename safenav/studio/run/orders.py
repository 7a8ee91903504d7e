"""What the server and the process of a run say to each other: JSON, one object a line.

To the process: a ``RunOrder`` first, then ``{"do": "step"}``, ``{"do": "change", ...}``, ``{"do":
"end"}``. From it: the lines of the trace, and lines whose ``type`` begins with ``~``: ``~done``
(a tick is over), ``~refused`` (a change that cannot be), ``~failed`` (the run ended in an error).
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from safenav.errors import UsageError
from safenav.runtime.interventions import Close, Give, Intervention, Serve, SetTruth, TakeAway
from safenav.scenario.model import Catalogue
from safenav.scenario.objective import Cover, Hold, Objective, Patrol, Visit
from safenav.scenario.yaml.findings import ReadableFolder
from safenav.world.map import RegionMap

DONE, REFUSED, FAILED = "~done", "~refused", "~failed"


@dataclass(frozen=True)
class RunOrder:
    """A scenario to run. ``folder``: where it may read files; None for nowhere, and ``trusted``
    for anywhere (the user has named the file). ``seed``: instead of its own. ``first``: robots that
    are judged before the others."""

    text: str
    file: str
    folder: str | None = None
    trusted: bool = False
    seed: int | None = None
    first: tuple[str, ...] = ()

    @property
    def reach(self) -> ReadableFolder | None:
        """Which files the scenario may name."""
        if self.trusted:
            return None
        return ReadableFolder(None if self.folder is None else Path(self.folder))

    def line(self) -> str:
        return json.dumps(asdict(self)) + "\n"

    @classmethod
    def read(cls, line: str) -> RunOrder:
        return cls(**json.loads(line))


def intervention(
    data: Mapping[str, Any], catalogue: Catalogue, world: RegionMap, robots: frozenset[str]
) -> Intervention:
    """A change as a page asks for it. Raises UsageError for one that makes no sense."""
    kind = data.get("kind")
    if kind == "close":
        name = str(data.get("type"))
        if name not in catalogue.obstacles:
            raise UsageError(f"the catalogue has no obstacle type '{name[:40]}'")
        kept = catalogue.obstacles[name]
        truth = bool(data.get("truth", True)) if kept.has_truth else None
        return Close(kept, _region(data.get("region"), world), truth)
    if kind == "open":
        return TakeAway(str(data.get("obstacle")))
    if kind == "truth":
        return SetTruth(str(data.get("obstacle")), bool(data.get("traversable")))
    robot = str(data.get("robot"))
    if robot not in robots:
        raise UsageError(f"there is no robot '{robot[:40]}'")
    if kind == "objective":
        return Give(robot, objective(data.get("objective"), world))
    if kind == "service":
        return Serve(robot, bool(data.get("active")))
    raise UsageError("unknown change; known: close, open, truth, objective, service")


def objective(data: object, world: RegionMap) -> Objective:
    """``{"visit": [3, 8]}`` as an objective. Raises UsageError."""
    if not isinstance(data, Mapping) or len(data) != 1:
        raise UsageError("an objective is one of patrol, visit, cover and hold")
    ((kind, told),) = data.items()
    listed = told if isinstance(told, list) else [told]
    targets = tuple(frozenset({_region(region, world)}) for region in listed)
    if kind == "hold" and len(targets) == 1:
        return Hold(targets[0])
    if kind == "patrol" and len(targets) == 2 and targets[0] != targets[1]:
        return Patrol(*targets)
    if kind == "visit" and targets:
        return Visit(targets)
    if kind == "cover" and targets:
        return Cover(targets)
    count = {"hold": "one region", "patrol": "two different regions"}
    raise UsageError(f"{kind} takes {count.get(str(kind), 'at least one region')}")


def _region(value: object, world: RegionMap) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < world.size:
        raise UsageError(f"{str(value)[:40]!r} is no region of the map")
    if not world.is_free(value):
        raise UsageError(f"region {value} is a wall: choose a free one")
    return value
