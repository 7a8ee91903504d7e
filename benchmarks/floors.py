"""Random missions on large floors, and on random-32-32-10 where this machine has it."""

import sys
from pathlib import Path
from random import Random

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from support.draft import HEADINGS, Data, Draft
from support.floors import open_floor, rooms, scattered
from support.missions import mission

__all__ = ["benchmark", "benchmark_map", "crowd", "maps_folder", "mirrored", "mission", "scattered"]

KINDS = ("visit", "visit", "cover", "patrol", "hold")


def mirrored(count: int) -> Data:
    """Quadcopters on an open floor that go to mirrored places on the other side: four of them on
    4 x 12 regions, twelve on 6 x 12."""
    rows = 4 if count <= 4 else 6
    draft = Draft(Random(count), open_floor(rows, 12), f"mirrored {count}", 1, 3000)
    west = [(r, c) for c in (1, 2) for r in range(1, rows + 1)][:count]
    for k, (row, col) in enumerate(west):
        start, target = [row, col], [rows + 1 - row, 13 - col]
        draft.robots[f"q{k}"] = {
            "model": "quadcopter",
            "start": start,
            "objective": {"visit": [target, start]},
        }
    return draft.data


def maps_folder() -> Path | None:
    """Return the folder of the MovingAI maps, if this machine has them."""
    here = Path(__file__).resolve()
    found = (parent / "shared" / "maps" for parent in here.parents)
    return next((folder for folder in found if folder.is_dir()), None)


def benchmark_map(folder: Path) -> tuple[list[str], list[list[int]]]:
    """The grid of random-32-32-10, and starts and goals: column and row of each."""
    text = (folder / "random-32-32-10.map").read_text().split("map\n", 1)[1]
    lines = (folder / "random-32-32-10-random-1.scen").read_text().splitlines()[1:]
    tasks = [list(map(int, line.split("\t")[4:8])) for line in lines]
    return text.replace("@", "#").split(), tasks


def benchmark(robots: int, flyers: int, doors: int, seed: int) -> Data:
    """random-32-32-10 with starts and goals of its .scen: half of the robots with headings."""
    folder = maps_folder()
    assert folder is not None
    random = Random(f"benchmark {seed}")
    text, tasks = benchmark_map(folder)
    cols = len(text[0])
    draft = Draft(random, text, f"random-32-32-10 {robots} {seed}", 1, 5000)
    draft.models["rover"] = {"mobility": "free", "layer": "ground", "capabilities": ["push"]}
    taken, goals = set[int](), set[int]()
    for x, y, goal_x, goal_y in tasks[seed:]:
        start, goal = y * cols + x, goal_y * cols + goal_x
        k = len(draft.robots)
        if k == robots:
            break
        if start in taken or start == goal:
            continue
        model = "digit" if k % 2 else "rover"
        robot = {"model": model, "start": start, "objective": {"visit": [goal, start]}}
        robot |= {"heading": random.choice(HEADINGS)} if model == "digit" else {}
        if draft.accepted(robots={f"{model}{k}": robot}):
            draft.robots[f"{model}{k}"] = robot
            taken.add(start)
            goals.add(goal)
    for k in range(flyers):
        draft.place(f"quad{k}", "quadcopter", lambda _: draft.targets("visit"))
    narrow = [r for r in draft.narrow() if r not in taken | goals] or draft.free
    for region in random.sample(narrow, doors):
        draft.obstacle("door", region)
    return draft.data


def crowd(seed: int, count: int) -> Data:
    """A number of robots in rooms with doors one region wide, some closed; every fifth flies."""
    random = Random(f"timed crowd {seed} {count}")
    while True:
        down, across = (1, 2) if count < 4 else (2, 2) if count < 10 else (2, 3)
        grid = rooms(random, down, across, random.randint(3, 4), random.randint(3, 5))
        draft = Draft(random, grid, f"crowd of {count}, {seed}", 1, 4000)
        draft.models["rover"] = {"mobility": "free", "layer": "ground", "capabilities": ["push"]}
        draft.models["cart"] = {"mobility": "free", "layer": "ground"}
        for k in range(count):
            model = (
                "quadcopter" if k % 5 == 4 else random.choice(["digit", "rover", "rover", "cart"])
            )
            draft.place(
                f"{model}{k}", model, lambda _, draft=draft: draft.targets(random.choice(KINDS))
            )
        doors = draft.narrow()
        for region in random.sample(doors, min(len(doors), random.randint(0, 3))):
            draft.obstacle(random.choice(["door", "door", "uncertainty"]), region)
        if len(draft.robots) == count:
            return draft.data
