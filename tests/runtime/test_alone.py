"""A robot alone with rules beside its objective (``avoid``, ``always``), or with a formula about an
input of the environment: judged by a game on explicit states and a walk over the trace. Teams are
played by campaigns."""

import json
import os
from collections.abc import Callable, Iterable
from random import Random
from typing import Any, NamedTuple

import numpy as np
import pytest

from certify.making import certified
from drawn import loads
from oracle.game import Game, solve
from runtime.played import play
from support.draft import Data
from support.floors import framed, free_in

WANTED = int(os.environ.get("SAFENAV_FUZZ", "6"))
HEADINGS = ("north", "east", "south", "west")
BUNDLED = 5
"""Every so many runs, a bundle is checked."""


class Turn(NamedTuple):
    """The regions before and after, the heading after, the values of the input before and after,
    and two regions that a rule names."""

    r: int
    q: int
    h: int
    a: int
    b: int
    x: int = 0
    y: int = 0


Rule = tuple[str, Callable[[Turn], Any]]
ALWAYS: list[Rule] = [
    ("region = {x} -> region' != {y}", lambda t: t.r != t.x or t.q != t.y),
    (
        "region > {x} | region' < {y} | region' = {x}",
        lambda t: t.r > t.x or t.q < t.y or t.q == t.x,
    ),
    ("!(region' = region + 1 & region = {x})", lambda t: not (t.q == t.r + 1 and t.r == t.x)),
]
HEADED: list[Rule] = [
    (f"heading' != {k} | region' != {{y}}", lambda t, k=k: t.h != k or t.q != t.y) for k in range(4)
]
SAFETY: list[Rule] = [
    ("alarm' -> region' = region", lambda t: not t.b or t.q == t.r),
    ("alarm' -> region' != {x}", lambda t: not t.b or t.q != t.x),
    ("alarm & alarm' -> region' = {x}", lambda t: not (t.a and t.b) or t.q == t.x),
    ("!alarm' -> region' != {x}", lambda t: t.b or t.q != t.x),
]
GOALS: list[Rule] = [
    ("region' = {y} | alarm'", lambda t: t.q == t.y or t.b),
    ("region' = {y}", lambda t: t.q == t.y),
    ("region' = {y} & alarm'", lambda t: t.q == t.y and t.b),
]
FAIR = {None: (), "off": (0,), "on": (1,), "both": (0, 1)}


class Drawn:
    """A random scenario, with its rules as text and as functions. ``formula``: the objective is a
    formula, which also rules stays; otherwise the robot may always stay."""

    def __init__(self, seed: int, formula: bool) -> None:
        self.random = random = Random(f"alone {seed}")
        self.formula, rows = formula, 2 if formula else 3
        cells = "".join("." if random.random() < 0.83 else "#" for _ in range(4 * rows))
        self.grid = framed([cells[k : k + 4] for k in range(0, 4 * rows, 4)])
        self.cells, self.cols, self.free = "".join(self.grid), 6, free_in(self.grid) or [0]
        self.fair: tuple[int, ...] = ()
        model = random.choice(["digit", "quadcopter", "rover"])
        self.turns, self.start = model == "digit", random.choice(self.free)
        heading = random.choice(HEADINGS) if self.turns else "north"
        self.at = self.start, HEADINGS.index(heading)
        self.inputs: Data = {"alarm": {"at": [t for t in range(1, 61) if random.random() < 0.3]}}
        self.rules, self.goals, self.avoid = list[Rule](), list[Rule](), set[int]()
        self.objective = self._formula() if formula else self._targets()
        self.data = {
            "safenav": 1,
            "clock": "lockstep",
            "map": {"grid": self.grid},
            "catalogue": {"robots": {"rover": {"mobility": "free", "layer": "ground"}}},
            "inputs": self.inputs,
            "robots": {
                "bot": {"model": model, "start": self.start, "objective": self.objective}
                | ({"heading": heading} if self.turns else {})
            },
            "until": {"rounds": 2 if formula else 1},
            "limits": {"ticks": 60 if formula else 120},
        }

    def _rule(self, rules: list[Rule]) -> Rule:
        (text, holds), random = self.random.choice(rules), self.random
        x, y = random.choice(self.free), random.choice(self.free)
        return text.format(x=x, y=y), lambda t: holds(t._replace(x=x, y=y))

    def _formula(self) -> Data:
        self.rules, self.goals = [self._rule(SAFETY)], [self._rule(GOALS)]
        word = self.random.choice([*FAIR])
        self.fair = FAIR[word]
        self.inputs["alarm"] |= {"always_eventually": word} if word else {}
        return {"ltl": {"safety": self.rules[0][0], "liveness": self.goals[0][0]}}

    def _targets(self) -> Data:
        random = self.random
        kind = random.choice(["visit", "cover", "patrol", "once", "hold"])
        count = {"patrol": 2, "hold": 1}.get(kind, random.randint(1, 3))
        targets = random.sample(self.free, min(count, len(self.free)))
        others = [r for r in self.free if r != self.start and r not in targets]
        self.avoid = {*random.sample(others, min(len(others), random.randint(0, 2)))}
        self.goals = [("", lambda t, target=target: t.q == target) for target in targets]
        found: Data = {kind: targets[0] if kind == "hold" else targets}
        found |= {"avoid": [{"any": sorted(self.avoid)}]} if self.avoid else {}
        if random.random() < 0.6:
            rules = [ALWAYS, ALWAYS, ALWAYS, HEADED][: 4 if self.turns else 3]
            self.rules = [self._rule(random.choice(rules)) for _ in range(random.randint(1, 2))]
            found["always"] = [text for text, _ in self.rules]
        return found

    def possible(self, t: Turn, heading: int) -> bool:
        """Whether the map, the mobility and the rules allow this."""
        kept = all(holds(t) for _, holds in self.rules)
        if t.q == t.r:
            return t.h == heading and (kept or not self.formula)
        way = {-self.cols: 0, 1: 1, self.cols: 2, -1: 3}.get(t.q - t.r)
        legal = way is not None and self.cells[t.q] == "." and t.q not in self.avoid
        turns = not self.turns or (way == t.h and way != (heading + 2) % 4)
        return legal and turns and kept

    def can(self) -> bool:
        """Whether the robot wins against all values of the input: pose and value are the state, the
        environment picks the next value, then the robot its next pose."""
        poses = [(r, h) for r in self.free for h in range(4 if self.turns else 1)]
        poses = [self.at, *(pose for pose in poses if pose != self.at)]
        flags = (0, 1) if self.formula else (0,)
        states = [(pose, a) for pose in poses for a in flags]

        def moves(holds: Callable[[Turn, int], object]) -> Any:
            """The transitions [state, next value, next pose] for which this holds."""
            return np.array(
                [
                    [[bool(holds(Turn(r, q, h, a, b), heading)) for q, h in poses] for b in flags]
                    for (r, heading), a in states
                ]
            )

        sys, goals = moves(self.possible), [moves(lambda t, _, g=g: g(t)) for _, g in self.goals]
        if self.objective.keys() & {"hold", "once"}:
            return self._reaches(sys[:, 0], [goal[0, 0] for goal in goals])
        everything, start = np.ones_like(sys), np.arange(len(states)) == 0
        successors = np.array([[len(flags) * k + b for k in range(len(poses))] for b in flags])
        fair = [everything & (np.array(flags)[:, None] == value) for value in self.fair]
        env = everything[:, :, 0]
        game = Game((), successors, start, start, env, sys, fair or [everything], goals)
        return bool(solve(game).winning[0])

    def _reaches(self, steps: Any, targets: Iterable[Any]) -> bool:
        """Whether it can be at one target after the other, from its start, and stay at the last."""
        at = np.arange(len(steps)) == 0
        for target in targets:
            for _ in steps:
                at = at | steps[at].any(0)
            at = at & target
        return bool(at.any())


@pytest.mark.parametrize("formula", [False, True], ids=["without formulas", "with formulas"])
@pytest.mark.parametrize("seed", range(3 * WANTED))
def test_an_objective_is_realizable_iff_its_game_is_won(
    seed: int, formula: bool, played: Callable[[], None]
) -> None:
    made = list[Drawn]()

    def draw(number: int) -> Data:
        made.append(Drawn(number, formula))
        return made[-1].data

    _, scenario = loads(draw, seed)
    drawn = made[-1]
    run = play(scenario)
    refused = run.outcome["outcome"] == "unrealizable"
    assert refused is not drawn.can(), drawn.data
    if run.all("move") or refused:
        played()
    at, before, now, goals = drawn.at, 0, 0, 0
    for line in run.records:
        if line["type"] == "inputs":
            now = int(line["values"]["alarm"])
        elif line["type"] == "move":
            heading = HEADINGS.index(line["heading"]) if drawn.turns else at[1]
            turn = Turn(at[0], line["to"], heading, before, now)
            assert drawn.possible(turn, at[1]), line
            goals += all(goal(turn) for _, goal in drawn.goals)
            at, before = (line["to"], heading), now
    assert goals >= 2 or run.outcome["outcome"] != "completed" or not formula
    if seed % BUNDLED == 0:
        certified(json.dumps(drawn.data))
