"""The cost of motion: planning, sampling, case study 1, and 1,000 ticks of six robots.

    python benchmarks/motion.py

Prints a line for each bar of docs/motion.md; CPU seconds of one process.
"""

import json
import random
import resource
import tempfile
import time
from pathlib import Path

import numpy as np

from safenav import Mission, TraceWriter, load_scenario
from safenav.motion.check.verdict import check_motion
from safenav.motion.columns import sample
from safenav.motion.file import Moving, Segment, text_of
from safenav.motion.flyer import HORIZON, AxisTracker
from safenav.motion.geometry import HEADINGS, MetricFloor, turn
from safenav.motion.making import motion_of
from safenav.motion.walker import WalkerMover
from safenav.trace.file import read_bytes

ROOT = Path(__file__).parents[1]
VALUES = {"size": 0.6, "speed": 0.45, "height": 0.8, "foot": 0.18, "clearance": 0.12}
SIDE = 60


def main() -> None:
    walking()
    solving()
    content = trace_of("case_study_1")
    run("case study 1", content)
    run("case study 1, tracked", content, track=True)
    run("1,000 ticks of six robots", long_trace(1000))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{'peak memory of this process':42s} {peak:8.0f} MB      (bar 500)")


def walking() -> None:
    """Plan and sample random moves."""
    floor = MetricFloor(SIDE, SIDE, 2.7)
    mover = WalkerMover("digit", floor, SIDE * SIDE // 2, "east", VALUES, "walker")
    steps = {"east": 1, "north": -SIDE, "west": -1, "south": SIDE}
    chance = random.Random(0)
    found: list[Segment] = []
    begin = time.process_time()
    for tick in range(2000):
        assert mover.heading is not None
        ways = [heading for heading in HEADINGS if turn(mover.heading, heading) != 2]
        heading = chance.choice(ways)
        if not (SIDE < mover.region < SIDE * (SIDE - 1) and 1 < mover.region % SIDE < SIDE - 2):
            mover.region = SIDE * SIDE // 2 + SIDE // 2
        found += mover.move(tick, mover.region + steps[heading])
    told("plan of a coarse move", (time.process_time() - begin) / 2000 * 1e3, "ms", 1)
    begin = time.process_time()
    for segment in found[:300]:
        sample(segment, np.arange(0.0, segment.t1 - segment.t0, 1e-3), mover.values)
    told("all 1 kHz columns of a move", (time.process_time() - begin) / 300 * 1e3, "ms", 10)


def solving() -> None:
    """Commands along one axis with an active corridor: two are one of the quadcopter's."""
    tracker = AxisTracker(0.0, 3.4)
    wanted, far = np.tile([2.0, 0.5, 0.0], (HORIZON, 1)), np.full(HORIZON, 9.0)
    near = np.full(HORIZON, 0.4)
    spent = []
    for _ in range(500):
        tracker.state = np.array([0.0, 0.9, 0.1, 0.0])
        begin = time.perf_counter()
        tracker.command(wanted, -far, near)
        spent.append(time.perf_counter() - begin)
    told("quadratic programmes of a command, median", 2 * float(np.median(spent)) * 1e3, "ms", 1)


def run(name: str, content: bytes, *, track: bool = False) -> None:
    """The whole command: read, move, write; then its check."""
    begin = time.perf_counter()
    trace = read_bytes(content, name)
    motion = motion_of(trace, track=track)
    size = len(text_of(motion))
    told(name, time.perf_counter() - begin, "s", 2 if name == "case study 1" else 15)
    spent = []
    for _ in range(3):
        begin = time.process_time()
        wrong = check_motion(motion, trace)
        spent.append(time.process_time() - begin)
    moves = sum(piece.origin != piece.to for piece in motion.of(Moving))
    told("    check of a move", min(spent) / moves * 1e3, "ms", 0.4)
    verdict = "accepted" if not wrong else str(wrong[0])
    print(f"    {size / 1e6:.1f} MB, {motion.outcome.makespan:.0f} s of motion: {verdict}")


def trace_of(name: str) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "trace.jsonl"
        with TraceWriter(path) as writer:
            Mission(load_scenario(ROOT / "scenarios" / f"{name}.yaml"), listeners=[writer]).run()
        return path.read_bytes()


def long_trace(ticks: int) -> bytes:
    """Six robots that never rest: the ways of the team of six, there and back forever. Each
    goes round a ring of its own, so that all move in every tick."""
    kinds = ("digit", "digit", "rover", "rover", "quad", "quad")
    header = json.loads(trace_of("team_of_six").splitlines()[0])
    scenario = header["scenario"]
    known = {"digit": "digit", "quad": "hawk", "rover": "sweeper"}
    rows, cols = 20, 20
    edge = {0, rows - 1}, {0, cols - 1}
    walls = [r for r in range(rows * cols) if r // cols in edge[0] or r % cols in edge[1]]
    scenario["map"] |= {"rows": rows, "cols": cols, "walls": walls}
    scenario["obstacles"] = []
    team = {robot["name"]: robot for robot in scenario["robots"]}
    faces, rings = set[str](), {}
    for number, kind in enumerate(kinds):
        name = f"{kind}{number}"
        top, left = 1 + number % 2 * 9, 1 + number // 2 * 6
        ring = ring_of(top, left, 8, 5, cols)
        mine = team[known[kind]]
        faces |= {name} if "heading" in mine["start"] else set()
        start = {"region": ring[0]} | ({"heading": 1} if name in faces else {})
        about = {"name": name, "start": start, "objective": {"hold": ring[0]}, "avoids": []}
        scenario["robots"] += [mine | about | {"tracks": []}]
        rings[name] = ring
    scenario["robots"] = scenario["robots"][len(team) :]
    lines = [header]
    for tick in range(1, ticks + 1):
        for name, ring in rings.items():
            here, there = ring[(tick - 1) % len(ring)], ring[tick % len(ring)]
            heading = {1: "east", -1: "west", cols: "south", -cols: "north"}[there - here]
            facing = heading if name in faces else None
            move = {"type": "move", "tick": tick, "robot": name, "from": here, "to": there}
            lines.append({**move, "heading": facing})
    return "".join(json.dumps(line) + "\n" for line in lines).encode()


def ring_of(top: int, left: int, height: int, width: int, cols: int) -> list[int]:
    """The regions of a rectangle's edge, clockwise from its north-western corner."""
    east = [(top, left + i) for i in range(width - 1)]
    south = [(top + i, left + width - 1) for i in range(height - 1)]
    west = [(top + height - 1, left + width - 1 - i) for i in range(width - 1)]
    north = [(top + height - 1 - i, left) for i in range(height - 1)]
    return [row * cols + col for row, col in east + south + west + north]


def told(name: str, value: float, unit: str, bar: float) -> None:
    print(f"{name:42s} {value:8.3f} {unit:6s}  (bar {bar:g})")


if __name__ == "__main__":
    main()
