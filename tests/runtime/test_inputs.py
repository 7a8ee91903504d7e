"""Inputs of the environment: in formulas, and as triggers of other objectives. Judged by a game and
a walk over the trace of this file's own."""

# ruff: noqa: ARG002, ARG005 (worlds and formulas read some of what they are given)

import json
import os
import random
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from certify.making import certified
from oracle.game import Game, solve
from runtime.facts import case
from runtime.played import completed, play
from runtime.worlds import Bare, Driven
from safenav.runtime.run.mission import default_synthesizer, first_results
from safenav.scenario.reading.loader import load_scenario_text

WANTED = int(os.environ.get("SAFENAV_FUZZ", "6"))
COLS, ROWS = 4, 2
BUNDLED = 6

FORMULAS = (
    ("alarm' -> region' = region", lambda r, q, a, b: not b or q == r),
    ("alarm' -> region' != {x}", lambda r, q, a, b, x: not b or q != x),
    ("alarm & alarm' -> region' = {x}", lambda r, q, a, b, x: not (a and b) or q == x),
    ("!alarm' -> region' != {x}", lambda r, q, a, b, x: b or q != x),
)
GOALS = (
    ("region' = {y} | alarm'", lambda r, q, a, b, y: q == y or b),
    ("region' = {y}", lambda r, q, a, b, y: q == y),
    ("region' = {y} & alarm'", lambda r, q, a, b, y: q == y and b),
)


def drawn(seed: int) -> tuple[dict[str, Any], Any, Any, tuple[bool, ...]]:
    """One robot with a formula and a goal about an input; these two as functions of region before
    and after, input before and after; the values assumed infinitely often."""
    rng = random.Random(f"inputs {seed}")
    cells = ["." if rng.random() < 0.8 else "#" for _ in range(ROWS * COLS)]
    cells[0] = "."
    x, y = (rng.choice([r for r, cell in enumerate(cells) if cell == "."]) for _ in range(2))
    safety, goal = rng.choice(FORMULAS), rng.choice(GOALS)
    again = rng.choice([(), (False,), (True,), (False, True)])
    word = {(): None, (False,): "off", (True,): "on", (False, True): "both"}[again]
    on = [tick for tick in range(1, 61) if rng.random() < 0.3]
    document = {
        "safenav": 1,
        "clock": "lockstep",
        "map": {"grid": ["".join(cells[:COLS]), "".join(cells[COLS:])]},
        "inputs": {"alarm": {"at": on} | ({"always_eventually": word} if word else {})},
        "robots": {
            "bot": {
                "model": "quadcopter",
                "start": 0,
                "objective": {
                    "ltl": {"safety": safety[0].format(x=x), "liveness": goal[0].format(y=y)}
                },
            }
        },
        "until": {"rounds": 2},
        "limits": {"ticks": 60},
    }
    args = (x,) if "{x}" in safety[0] else ()

    def kept(*step: int) -> bool:
        return bool(safety[1](*step, *args))

    return document, kept, lambda *step: bool(goal[1](*step, y)), again


def realizable(document: dict[str, Any], kept: Any, met: Any, again: tuple[bool, ...]) -> bool:
    """The game on explicit states, 2 r + a for region r and input a, by the oracle's fixpoint: the
    environment picks the next input, then the robot its next region."""
    cells = "".join(document["map"]["grid"])
    regions, flags = range(len(cells)), (0, 1)

    def moves(holds: Callable[[int, int, int, int], object]) -> np.ndarray:
        """The transitions [state, next input, next region] for which this holds."""
        every = ((r, a) for r in regions for a in flags)
        return np.array(
            [[[bool(holds(r, q, a, b)) for q in regions] for b in flags] for r, a in every]
        )

    def possible(r: int, q: int, a: int, b: int) -> object:
        near = q in (r, r - COLS, r + COLS) or (abs(q - r) == 1 and q // COLS == r // COLS)
        return near and cells[q] == "." and kept(r, q, a, b)

    everything, start = moves(lambda *_: True), np.arange(2 * len(cells)) == 0
    successors = np.array([[2 * q + b for q in regions] for b in flags])
    fair = [everything & (np.array(flags)[:, None] == value) for value in again] or [everything]
    env, sys, goal = everything[:, :, 0], moves(possible), moves(met)
    return bool(solve(Game((), successors, start, start, env, sys, fair, [goal])).winning[0])


@pytest.mark.parametrize("seed", range(3 * WANTED))
def test_an_objective_about_inputs_is_realizable_iff_the_game_is_won(
    seed: int, played: Callable[[], None]
) -> None:
    document, kept, met, again = drawn(seed)
    scenario = load_scenario_text(json.dumps(document))
    answer = first_results(scenario, default_synthesizer(scenario))["bot"]
    assert answer.realizable == realizable(document, kept, met, again), document
    run = play(document)
    if run.all("move") or not answer.realizable:
        played()
    goals = before = alarm = at = 0
    for line in run.records:
        if line["type"] == "inputs":
            alarm = int(line["values"]["alarm"])
        elif line["type"] == "move":
            assert kept(at, line["to"], before, alarm), line
            goals += met(at, line["to"], before, alarm)
            at, before = line["to"], alarm
    assert goals >= 2 or run.outcome["outcome"] != "completed"
    if seed % BUNDLED == 0:
        certified(json.dumps(document))


class Caller(Driven):
    """A world of a user, who calls in some ticks."""

    def inputs(self, tick: int) -> dict[str, bool]:
        return {"call": 6 <= tick <= 8, "alarm": False}


def test_a_world_determines_inputs_without_a_schedule() -> None:
    text = (
        case("inputs/fire").replace("{at: [4-9, 20]}", "{}").replace("call: {}", "call: {at: 6-8}")
    )
    lines = play(text, world=Caller).records
    told = [(x["tick"], x["values"]["call"]) for x in lines if x["type"] == "inputs"]
    assert told == [(6, True), (9, False)]


class Street(Bare):
    """A world in which both inputs change while every robot stands."""

    def inputs(self, tick: int) -> dict[str, bool]:
        return {"green": self.time > 30.0, "alarm": 2.0 < self.time < 60.0}


def test_a_run_in_which_no_robot_moves_waits_for_inputs_of_its_world() -> None:
    assert completed(case("inputs/green"), world=Street()).outcome["t"] >= 60.0
