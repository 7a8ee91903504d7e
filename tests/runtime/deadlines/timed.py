"""Random missions with tight deadlines in ticks."""

from random import Random

from runtime.teams import team_scenario
from support.boards import walled


def timed_scenario(seed: int) -> str:
    """A team's scenario with limits on resolutions, rounds and the whole mission."""
    random = Random(f"timed {seed}")
    lines = []
    for line in team_scenario(seed).splitlines():
        rounds = "{visit:" in line or "{patrol:" in line
        if line.startswith("  r") and rounds and random.random() < 0.6:
            line = line.replace("]}}", f"], within: {random.randint(6, 30)}}}}}")
        if line.startswith("  - {type:") and random.random() < 0.5:
            line = line.replace("}", f", resolve_within: {random.randint(0, 12)}}}")
        if line.startswith("until:") and random.random() < 0.6:
            line = f"until: {{rounds: 1, by: {random.randint(15, 90)}}}"
        lines.append(line)
    if random.random() < 0.6:
        lines.append(f"resolve_within: {random.randint(2, 20)}")
    if random.random() < 0.2:
        lines.append("late: stop")
    return "\n".join(lines) + "\n"


def busy_scenario(seed: int) -> str:
    """Several requests that are due soon: orders and obstacles in the way, on one or two floors."""
    random = Random(f"busy {seed}")
    rows, cols = random.randint(3, 6), random.randint(5, 9)
    grid = walled(random, rows, cols, 0.12)
    free = [(r, c) for r, row in enumerate(grid) for c, cell in enumerate(row) if cell == "."]
    random.shuffle(free)
    shared = random.random() < 0.5
    lines = ["safenav: 1", "map:", "  grid:", *(f'    - "{row}"' for row in grid)]
    lines += ["catalogue:", "  robots:"]
    count = random.choice((2, 2, 3, 3, 4))
    for k in range(count):
        skills = [action for action in ("lift", "push") if random.random() < 0.6]
        mobility = random.choice(("free", "free", "heading"))
        layer = "ground" if shared and random.random() < 0.8 else f"layer{k}"
        ticks = random.choice((1, 1, 1, 2, 3, 3))
        lines.append(
            f"    m{k}: {{mobility: {mobility}, layer: {layer}, timing: {ticks},"
            f" capabilities: [{', '.join(skills)}]}}"
        )
    both = random.choice(("robots: 2, together: true", "robots: 2", "robots: 1"))
    lines += [
        "  obstacles:",
        "    parcel: {needs: [{action: lift, at: neighbours}], blocks: []}",
        "    gate: {needs: [{action: push, at: neighbours}]}",
        f"    beam: {{needs: [{{action: lift, at: neighbours, {both}}}]}}",
        "robots:",
    ]
    for k in range(count):
        row, col = free.pop()
        heading = random.choice(("north", "east", "south", "west"))
        away = free[random.randrange(len(free))]
        facing = f", heading: {heading}" if f"m{k}: {{mobility: heading" in "\n".join(lines) else ""
        lines.append(
            f"  r{k}: {{model: m{k}, start: [{row}, {col}]{facing},"
            f" objective: {{visit: [[{away[0]}, {away[1]}], [{row}, {col}]]}}}}"
        )
    kinds, places = ("gate", "beam", "gate"), free[: random.randint(1, 3)]
    lines.append("obstacles:")
    for kind, (row, col) in zip(kinds, places, strict=False):
        limit = random.randint(2, 14)
        lines.append(f"  - {{type: {kind}, region: [{row}, {col}], resolve_within: {limit}}}")
    lines.append("orders:")
    for row, col in free[3 : 3 + random.randint(1, 3)]:
        at, limit = random.randint(1, 6), random.randint(1, 14)
        lines.append(
            f"  - {{at: {at}, type: parcel, region: [{row}, {col}], resolve_within: {limit}}}"
        )
    due = f", by: {random.randint(20, 60)}" if random.random() < 0.3 else ""
    lines += [f"until: {{rounds: 1{due}}}", "limits: {ticks: 250}"]
    return "\n".join(lines) + "\n"
