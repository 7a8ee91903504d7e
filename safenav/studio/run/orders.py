"""Messages between the server and the process of a run: JSON, one object per line.

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

from safenav.errors import InputError, UsageError
from safenav.runtime.interventions import Close, Give, Intervention, Serve, SetTruth, TakeAway
from safenav.scenario.model import Scenario
from safenav.scenario.reading.changes import ChangeReader
from safenav.scenario.reading.regions import RegionReader
from safenav.scenario.yaml.document import Node
from safenav.scenario.yaml.findings import Findings, ReadableFolder
from safenav.scenario.yaml.source import parsed

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
        """The files that the scenario may name."""
        if self.trusted:
            return None
        return ReadableFolder(None if self.folder is None else Path(self.folder))

    def line(self) -> str:
        return json.dumps(asdict(self)) + "\n"

    @classmethod
    def read(cls, line: str) -> RunOrder:
        return cls(**json.loads(line))


def intervention(data: Mapping[str, Any], scenario: Scenario) -> Intervention:
    """A change that a page requests, read as the scenario's loader reads its parts. Raises
    UsageError for one that is not possible."""
    findings = Findings("the change")
    found = _read(data, scenario, findings)
    try:
        findings.raise_if_any()
    except InputError as error:
        told = (f"{d.found} ({d.hint})" if d.hint else d.found for d in error.diagnostics)
        raise UsageError("; ".join(told)) from error
    if found is None:
        raise UsageError("unknown change; known: close, open, truth, objective, service")
    return found


def _read(data: Mapping[str, Any], scenario: Scenario, findings: Findings) -> Intervention | None:
    world, types = scenario.map, scenario.catalogue.obstacles
    regions = RegionReader(world, world.names, findings, world.areas)
    match data.get("kind"):
        case "close":
            name = str(data.get("type"))
            if name not in types:
                raise UsageError(f"the catalogue has no obstacle type '{name[:40]}'")
            region = regions.region(_node(data.get("region"), findings), "'region'")
            truth = bool(data.get("truth", True)) if types[name].has_truth else None
            return None if region is None else Close(types[name], region, truth)
        case "open":
            return TakeAway(str(data.get("obstacle")))
        case "truth":
            return SetTruth(str(data.get("obstacle")), bool(data.get("traversable")))
        case "objective" | "service" as kind:
            what = "back" if data.get("active") else "out"
            told = data.get("objective") if kind == "objective" else what
            names = frozenset(robot.name for robot in scenario.robots)
            reader = ChangeReader(regions, scenario.robots, names, findings, reachable=False)
            listed = [{"at": 1, "robot": data.get("robot"), kind: told}]
            for change in reader.read(_node(listed, findings)):
                if change.objective is not None:
                    return Give(change.robot, change.objective)
                return Serve(change.robot, change.active is True)
    return None


def _node(data: object, findings: Findings) -> Node | None:
    document = parsed(json.dumps(data), findings)
    return None if document is None else document.root
