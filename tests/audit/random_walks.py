"""Random traces that obey the rules: walks on random maps, where doors are opened on the way."""

import random

from audit.trace_script import WAYS, Line, Script, obstacle, robot

_OPPOSITE = {"north": "south", "south": "north", "east": "west", "west": "east"}


def random_walk(seed: int, ticks: int = 12) -> list[Line]:
    """A trace of a team that walks about, ends at its tick limit, and breaks no rule.

    One layer is shared by two robots; the third flies, and does not enter a closed door.
    """
    rng = random.Random(seed)
    rows, cols = rng.randint(4, 7), rng.randint(5, 9)
    cells = [
        [rng.random() < 0.15 or r in (0, rows - 1) or c in (0, cols - 1) for c in range(cols)]
        for r in range(rows)
    ]
    for c in range(1, cols - 1):
        cells[1][c] = cells[2][1] = False  # room enough for the robots and a door
    free = [r * cols + c for r in range(rows) for c in range(cols) if not cells[r][c]]
    starts = rng.sample(free, 4)
    door = starts.pop()
    heading = rng.choice(list(WAYS))
    robots = {
        "rover": robot("ground", ["push"], starts[0], {"ltl": {}}),
        "digit": robot("ground", ["push"], starts[1], {"visit": [starts[0], door]}, heading),
        "quad": robot("air", [], starts[2], {"ltl": {}}),
    }
    grid = "\n".join("".join("#" if wall else "." for wall in row) for row in cells)
    closed = obstacle("door", door, "push", [door], list(robots))
    script = Script(grid, robots, [closed], rounds=ticks, ticks=ticks)
    opened, awaited, rounds = False, 0, 0
    for _ in range(ticks):
        script.next_tick()
        for name in robots:
            to = rng.choice(_choices(script, name, free, set() if opened else {door}))
            script.move(name, to)
            if to == door and name != "quad" and not opened:
                opened = True
                script.resolve(name, closed["name"], requested=False)
            if name == "digit" and to == (starts[0], door)[awaited]:
                rounds += awaited
                script.goal("digit", awaited, rounds)
                awaited = 1 - awaited
    return script.end("tick_limit", {"rover": 0, "digit": rounds, "quad": 0})


def _choices(script: Script, name: str, free: list[int], closed: set[int]) -> list[int]:
    """Where a robot may be after its turn."""
    here, faced = script.position[name], script.heading[name]
    same_layer = {"rover": "digit", "digit": "rover"}
    taken = {script.position[same_layer[name]]} if name in same_layer else closed
    found = [here]
    for way, (south, east) in WAYS.items():
        to = here + south * script.cols + east
        if to in free and to not in taken and (faced is None or way != _OPPOSITE[faced]):
            found.append(to)
    return found
