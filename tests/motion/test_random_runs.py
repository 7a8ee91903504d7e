"""Random runs of two to six robots of all kinds, by seed: moved, accepted, and no longer than
the chain that is named."""

from __future__ import annotations

import json
import os
import random
from hashlib import sha256
from itertools import pairwise

import pytest

from safenav.motion.check.verdict import check_motion
from safenav.motion.file.reading import parsed
from safenav.motion.file.writing import text_of
from safenav.motion.making import motion_of
from safenav.scenario.motion import Motion, resolved
from safenav.trace.reading import read_bytes

RUNS = int(os.environ.get("SAFENAV_MOTION_RUNS", "24"))
TICKS = 25
WAYS = {"north": (-1, 0), "east": (0, 1), "south": (1, 0), "west": (0, -1)}
ORDER = list(WAYS)
KINDS = {
    "walker": ("heading", "ground", ["push"]),
    "rover": ("free", "ground", ["push"]),
    "disc": ("free", "ground", []),
    "flyer": ("free", "air", ["sense"]),
}


class Run:
    """Robots that wander at random, one after the other, by the rules of docs/trace.md."""

    def __init__(self, seed: int) -> None:
        self.chance = random.Random(seed)
        self.rows, self.cols = self.chance.randint(5, 9), self.chance.randint(5, 9)
        self.grid = [
            "".join(
                "#" if self._edge(r, c) or self.chance.random() < 0.12 else "."
                for c in range(self.cols)
            )
            for r in range(self.rows)
        ]
        self.free = [
            r * self.cols + c
            for r in range(self.rows)
            for c in range(self.cols)
            if self.grid[r][c] == "."
        ]
        places = self.chance.sample(self.free, min(len(self.free), 9))
        count = min(self.chance.randint(2, 6), len(places) - 2)
        self.kinds = {f"r{i}": self.chance.choice(list(KINDS)) for i in range(count)}
        self.at = dict(zip(self.kinds, places, strict=False))
        self.facing = {name: self.chance.choice(ORDER) for name in self.kinds}
        self.starts, self.headings = dict(self.at), dict(self.facing)
        self.doors = set(places[count : count + 2])
        self.lines: list[dict[str, object]] = []

    def _edge(self, row: int, col: int) -> bool:
        return row in (0, self.rows - 1) or col in (0, self.cols - 1)

    def conflicts(self, name: str) -> list[str]:
        layer = KINDS[self.kinds[name]][1]
        return [o for o in self.kinds if o != name and KINDS[self.kinds[o]][1] == layer]

    def blocks(self) -> list[str]:
        return [name for name in self.kinds if "push" not in KINDS[self.kinds[name]][2]]

    def play(self) -> bytes:
        shut = set(self.doors)
        for tick in range(1, TICKS + 1):
            for name, kind in self.kinds.items():
                here, to = self.at[name], self._chosen(name, shut)
                line = {"type": "move", "tick": tick, "robot": name, "from": here, "to": to}
                facing = self.facing[name] if KINDS[kind][0] == "heading" else None
                self.lines.append({**line, "heading": facing})
                self.at[name] = to
                if to in shut and "push" in KINDS[kind][2]:
                    shut.discard(to)
                    done = {"type": "resolved", "tick": tick, "obstacle": f"door@{to}", "at": to}
                    self.lines.append(
                        {**done, "robot": name, "requested": False, "traversable": None}
                    )
        return "".join(json.dumps(line) + "\n" for line in [self._header(), *self.lines]).encode()

    def _chosen(self, name: str, shut: set[int]) -> int:
        here, kind = self.at[name], self.kinds[name]
        taken = {self.at[other] for other in self.conflicts(name)}
        if name in self.blocks():
            taken |= shut
        ways = list(ORDER)
        if KINDS[kind][0] == "heading":
            ways.remove(ORDER[(ORDER.index(self.facing[name]) + 2) % 4])
        self.chance.shuffle(ways)
        for way in ways:
            down, right = WAYS[way]
            to = here + down * self.cols + right
            if to in self.free and to not in taken and self.chance.random() < 0.85:
                self.facing[name] = way
                return to
        return here

    def _header(self) -> dict[str, object]:
        robots = {}
        for name, kind in self.kinds.items():
            mobility, layer, skills = KINDS[kind]
            robots[name] = {
                "model": kind,
                "mobility": mobility,
                "layer": layer,
                "capabilities": skills,
                "conflicts": self.conflicts(name),
                "start": self.starts[name],
                "heading": self.headings[name] if mobility == "heading" else None,
                "objective": {"hold": self.starts[name]},
                "motion": resolved(Motion(kind), None, None),
            }
        doors = [
            {
                "type": "door",
                "name": f"door@{region}",
                "region": region,
                "action": "push",
                "resolution_regions": [region],
                "blocks": self.blocks(),
                "traversable": None,
            }
            for region in sorted(self.doors)
        ]
        scenario = {
            "name": "random",
            "map": {"rows": self.rows, "cols": self.cols, "grid": self.grid},
            "robots": robots,
            "obstacles": doors,
            "world": "simulated",
            "until": {},
            "limits": {},
            "seed": 0,
            "coordination": "resynthesis",
        }
        return {"type": "header", "trace": 2, "safenav": "0", "scenario": scenario}


@pytest.mark.parametrize("seed", range(RUNS))
def test_random_run_is_moved_accepted_and_as_long_as_its_chain(seed: int) -> None:
    content = Run(seed).play()
    digest = sha256(content).hexdigest()
    trace = read_bytes(content, f"random {seed}")
    motion = parsed(text_of(motion_of(trace, digest)).encode(), "made")
    assert check_motion(motion, trace, digest) == []
    chain, makespan = motion.outcome.chain, motion.outcome.makespan
    if chain:
        assert chain[0].t0 == 0
        assert chain[-1].t1 == pytest.approx(makespan, abs=1e-9)
    assert all(after.t0 == pytest.approx(before.t1, abs=1e-8) for before, after in pairwise(chain))
