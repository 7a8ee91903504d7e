"""Rules beside an objective (``avoid``, ``always``): judged by a game and a walk over the trace of
this file's own."""

import json
import os
import random
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from certify.making import certified
from runtime.played import play
from safenav.errors import InputError
from safenav.runtime.mission import Mission
from safenav.scenario.reading.loader import load_scenario_text

WANTED = int(os.environ.get("SAFENAV_FUZZ", "6"))
HEADINGS = ("north", "east", "south", "west")
BUNDLED = 5  # every so many runs

Pose = tuple[int, int | None]
Rule = Callable[[Pose, Pose], bool]


class Drawn:
    """A random scenario as data, with its rules as text and as functions."""

    def __init__(self, seed: int, *, team: bool) -> None:
        self.rng = rng = random.Random(f"rules {seed}")
        self.rows, self.cols = (4, 5) if team else (3, 4)
        self.size = self.rows * self.cols
        self.walls = {r for r in range(self.size) if rng.random() < 0.15}
        self.free = [r for r in range(self.size) if r not in self.walls] or [0]
        self.walls -= {0}
        starts = rng.sample(self.free, min(len(self.free), rng.randint(2, 3) if team else 1))
        self.rules: dict[str, list[Rule]] = {}
        self.avoid: dict[str, set[int]] = {}
        self.robots = {f"r{k}": self._robot(f"r{k}", start) for k, start in enumerate(starts)}
        # Sent somewhere, a robot that may not turn round is to get back to all targets of 'once'.
        again = any("once" in robot["objective"] for robot in self.robots.values())
        self.coordination = "resynthesis" if again else rng.choice(["resynthesis", "assignable"])
        self.obstacles = []
        if team:
            rest = [r for r in self.free if r not in starts]
            for region in rng.sample(rest, min(len(rest), rng.randint(0, 2))):
                self.obstacles.append({"type": rng.choice(["door", "crate"]), "region": region})

    def _robot(self, name: str, start: int) -> dict[str, Any]:
        rng, model = self.rng, self.rng.choice(["digit", "quadcopter", "rover"])
        kind = rng.choice(["visit", "cover", "patrol", "once", "hold"])
        count = {"patrol": 2, "hold": 1}.get(kind, rng.randint(1, 3))
        targets = rng.sample(self.free, min(count, len(self.free)))
        objective: dict[str, Any] = {kind: targets[0] if kind == "hold" else targets}
        others = [r for r in self.free if r != start and r not in targets]
        self.avoid[name] = {*rng.sample(others, min(len(others), rng.randint(0, 2)))}
        if self.avoid[name]:
            objective["avoid"] = [{"any": sorted(self.avoid[name])}]
        self.rules[name] = []
        if rng.random() < 0.6:
            drawn = [self._rule(model == "digit") for _ in range(rng.randint(1, 2))]
            objective["always"] = [text for text, _ in drawn]
            self.rules[name] = [rule for _, rule in drawn]
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
        catalogue = {
            "robots": {
                "rover": {"mobility": "free", "layer": "ground", "capabilities": ["lift"]},
            },
            "obstacles": {"crate": {"action": "lift"}},
        }
        document = {
            "safenav": 1,
            "clock": "lockstep",
            "map": {"grid": rows},
            "robots": self.robots,
            "obstacles": self.obstacles,
            "catalogue": catalogue,
            "coordination": self.coordination,
            "until": {"rounds": 1},
            "limits": {"ticks": 120},
        }
        return json.dumps(document)

    def steps(self, robot: str, pose: Pose) -> Iterator[Pose]:
        """The poses after a step that the map, the mobility and the rules allow."""
        row, col = divmod(pose[0], self.cols)
        for way, (down, right) in enumerate(((-1, 0), (0, 1), (1, 0), (0, -1))):
            there = (row + down) * self.cols + col + right
            if not (0 <= row + down < self.rows and 0 <= col + right < self.cols):
                continue
            if pose[1] is not None and way == (pose[1] + 2) % 4:
                continue
            after = (there, None if pose[1] is None else way)
            if there not in self.walls | self.avoid[robot] and self.keeps(robot, pose, after):
                yield after

    def keeps(self, robot: str, before: Pose, after: Pose) -> bool:
        return all(rule(before, after) for rule in self.rules[robot])

    def start(self, robot: str) -> Pose:
        heading = self.robots[robot].get("heading")
        return self.robots[robot]["start"], None if heading is None else HEADINGS.index(heading)

    def reach(self, robot: str, poses: set[Pose]) -> set[Pose]:
        found, queue = set(poses), list(poses)
        while queue:
            for after in self.steps(robot, queue.pop()):
                if after not in found:
                    found.add(after)
                    queue.append(after)
        return found

    def can(self, robot: str) -> bool:
        """Whether the robot alone can pursue its objective for ever."""
        objective, at = self.robots[robot]["objective"], {self.start(robot)}
        if "hold" in objective or "once" in objective:
            for target in objective.get("once", [objective.get("hold")]):
                at = {pose for pose in self.reach(robot, at) if pose[0] == target}
            return bool(at)
        targets = next(v for k, v in objective.items() if k in ("visit", "cover", "patrol"))
        for pose in self.reach(robot, at):
            after = self.reach(robot, {pose})
            round_trip = {p for p in after if pose in self.reach(robot, {p})}
            if {*targets} <= {p[0] for p in round_trip}:
                return True
        return False


@pytest.mark.parametrize("seed", range(3 * WANTED))
def test_realizable_iff_a_walk_keeps_the_rules(seed: int) -> None:
    drawn = Drawn(seed, team=False)
    try:
        scenario = load_scenario_text(drawn.text(), reachable=False)
    except InputError as error:
        pytest.skip(str(error))
    mission = Mission(scenario)
    found = mission.first_results()["r0"].realizable
    assert found == drawn.can("r0"), drawn.text()


@pytest.mark.parametrize("seed", range(WANTED))
def test_no_robot_breaks_a_rule(seed: int) -> None:
    drawn = Drawn(seed, team=True)
    text = drawn.text()
    try:
        scenario = load_scenario_text(text)
    except InputError as error:
        pytest.skip(str(error))
    at = {robot: drawn.start(robot) for robot in drawn.robots}
    for line in play(scenario).all("move"):
        robot, faced = line["robot"], line.get("heading")
        pose = (line["to"], None if faced is None else HEADINGS.index(faced))
        assert pose[0] not in drawn.avoid[robot], (seed, line)
        assert pose[0] == at[robot][0] or drawn.keeps(robot, at[robot], pose), (seed, line)
        at[robot] = pose
    if seed % BUNDLED == 0:
        certified(text)
