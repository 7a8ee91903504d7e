"""Random missions with tight promises in ticks."""

from __future__ import annotations

from random import Random

from runtime.teams import team_scenario


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
