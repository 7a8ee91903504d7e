"""Rules beside an objective (``avoid``, ``always``): judged by a game and a walk over the trace of
this file's own, for a robot alone; teams: ``support.missions``."""

import json
import os
import random
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from certify.making import certified
from drawn import tried
from runtime.played import play
from safenav.runtime.run.mission import default_synthesizer, first_results
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario_text

WANTED = int(os.environ.get("SAFENAV_FUZZ", "6"))
HEADINGS = ("north", "east", "south", "west")
BUNDLED = 5  # every so many runs

Pose = tuple[int, int | None]
Rule = Callable[[Pose, Pose], bool]


class Drawn:
    """A random scenario as data, with its rules as text and as functions."""

    def __init__(self, seed: int) -> None:
        self.rng = rng = random.Random(f"rules {seed}")
        self.rows, self.cols = 3, 4
        self.size = self.rows * self.cols
        self.walls = {r for r in range(self.size) if rng.random() < 0.15}
        self.free = [r for r in range(self.size) if r not in self.walls] or [0]
        self.walls -= {0}
        self.rules: list[Rule] = []
        self.avoid: set[int] = set()
        self.robot = self._robot(rng.choice(self.free))

    def _robot(self, start: int) -> dict[str, Any]:
        rng, model = self.rng, self.rng.choice(["digit", "quadcopter", "rover"])
        kind = rng.choice(["visit", "cover", "patrol", "once", "hold"])
        count = {"patrol": 2, "hold": 1}.get(kind, rng.randint(1, 3))
        targets = rng.sample(self.free, min(count, len(self.free)))
        objective: dict[str, Any] = {kind: targets[0] if kind == "hold" else targets}
        others = [r for r in self.free if r != start and r not in targets]
        self.avoid = {*rng.sample(others, min(len(others), rng.randint(0, 2)))}
        if self.avoid:
            objective["avoid"] = [{"any": sorted(self.avoid)}]
        if rng.random() < 0.6:
            drawn = [self._rule(model == "digit") for _ in range(rng.randint(1, 2))]
            objective["always"] = [text for text, _ in drawn]
            self.rules = [rule for _, rule in drawn]
        robot = {"model": model, "start": start, "objective": objective}
        return robot | ({"heading": rng.choice(HEADINGS)} if model == "digit" else {})

    def _rule(self, turns: bool) -> tuple[str, Rule]:
        rng = self.rng
        a, b = rng.choice(self.free), rng.choice(self.free)
        match rng.randrange(4 if turns else 3):
            case 0:
                return f"region = {a} -> region' != {b}", lambda x, y: x[0] != a or y[0] != b
            case 1:
                return (
                    f"region > {a} | region' < {b} | region' = {a}",
                    lambda x, y: x[0] > a or y[0] < b or y[0] == a,
                )
            case 2:
                return (
                    f"!(region' = region + 1 & region = {a})",
                    lambda x, y: not (y[0] == x[0] + 1 and x[0] == a),
                )
            case _:
                return (
                    f"heading' != {a % 4} | region' != {b}",
                    lambda _, y: y[1] != a % 4 or y[0] != b,
                )

    def text(self) -> str:
        cells = ["#" if r in self.walls else "." for r in range(self.size)]
        rows = ["".join(cells[k : k + self.cols]) for k in range(0, self.size, self.cols)]
        document = {
            "safenav": 1,
            "clock": "lockstep",
            "map": {"grid": rows},
            "robots": {"r0": self.robot},
            "catalogue": {"robots": {"rover": {"mobility": "free", "layer": "ground"}}},
            "until": {"rounds": 1},
            "limits": {"ticks": 120},
        }
        return json.dumps(document)

    def steps(self, pose: Pose) -> Iterator[Pose]:
        """The poses after a step that the map, the mobility and the rules allow."""
        row, col = divmod(pose[0], self.cols)
        for way, (down, right) in enumerate(((-1, 0), (0, 1), (1, 0), (0, -1))):
            there = (row + down) * self.cols + col + right
            if not (0 <= row + down < self.rows and 0 <= col + right < self.cols):
                continue
            if pose[1] is not None and way == (pose[1] + 2) % 4:
                continue
            after = (there, None if pose[1] is None else way)
            if there not in self.walls | self.avoid and all(
                rule(pose, after) for rule in self.rules
            ):
                yield after

    @property
    def start(self) -> Pose:
        heading = self.robot.get("heading")
        return self.robot["start"], None if heading is None else HEADINGS.index(heading)

    def reach(self, poses: set[Pose]) -> set[Pose]:
        found, queue = set(poses), list(poses)
        while queue:
            for after in self.steps(queue.pop()):
                if after not in found:
                    found.add(after)
                    queue.append(after)
        return found

    def can(self) -> bool:
        """Whether the robot alone can pursue its objective forever."""
        objective, at = self.robot["objective"], {self.start}
        if "hold" in objective or "once" in objective:
            for target in objective.get("once", [objective.get("hold")]):
                at = {pose for pose in self.reach(at) if pose[0] == target}
            return bool(at)
        targets = next(v for k, v in objective.items() if k in ("visit", "cover", "patrol"))
        for pose in self.reach(at):
            after = self.reach({pose})
            round_trip = {p for p in after if pose in self.reach({p})}
            if {*targets} <= {p[0] for p in round_trip}:
                return True
        return False


def accepted(seed: int) -> tuple[Drawn, Scenario]:
    drawn = Drawn(seed)
    return drawn, load_scenario_text(drawn.text(), reachable=False)


@pytest.mark.parametrize("seed", range(3 * WANTED))
def test_an_objective_with_rules_is_realizable_iff_a_walk_keeps_them(
    seed: int, played: Callable[[], None]
) -> None:
    drawn, scenario = tried(accepted, seed)
    (answer,) = first_results(scenario, default_synthesizer(scenario)).values()
    assert answer.realizable == drawn.can(), drawn.text()
    played()
    if drawn.can():
        run, at = play(scenario), drawn.start
        for line in run.all("move"):
            faced = line["heading"]
            pose = line["to"], None if faced is None else HEADINGS.index(faced)
            assert pose == at or pose in drawn.steps(at), line
            at = pose
        if seed % BUNDLED == 0:
            certified(drawn.text())
