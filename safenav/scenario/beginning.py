"""Scenarios to start from: templates, and one on a map of the user."""

import json
import re
from collections.abc import Mapping
from pathlib import Path

from safenav.world.map import Region, RegionMap, pieces

TEMPLATES = {
    "minimal": "one robot that goes back and forth",
    "door": "a flying robot, a walking one, and a closed door that they discover",
    "team": "three robots on one floor, with models and an obstacle type of their own",
}
"""The purpose of each template; the texts are beside this module."""

DEFAULT = "door"


def template_text(name: str) -> str:
    """Return the YAML of a template."""
    folder = Path(__file__).with_name("templates")
    return (folder / f"{name}.yaml").read_text(encoding="utf-8")


def scenario_on(world: RegionMap, keys: Mapping[str, str | float], name: str) -> str | None:
    """Return the YAML of a scenario on a map; ``keys``: those of its ``map``.

    A flyer patrols between two regions that are far apart, and a rover goes back and forth
    between two others. A commented-out door stands where the flyer discovers it: at its second
    target. None if the map has no four connected regions.
    """
    floor = sorted(max(pieces(world.free, world), key=len, default=()))
    if len(floor) < 4:
        return None
    home = _farthest(world, floor[0])
    away = _farthest(world, home)
    depth = world.distances([home])
    between = sorted(
        (region for region in floor if region not in (home, away)), key=lambda r: (depth[r], r)
    )
    dock, far = between[len(between) // 4], between[-1]
    body = "\n".join(f"  {key}: {_written(value)}" for key, value in keys.items())
    side = 1.0 if world.frame is None else world.frame.resolution
    flyer = "quadcopter" if side >= 1 else "crazyflie"  # the one that fits into a region
    body_of = "" if world.frame is None else f", size: {min(0.5, side / 2):.3g}, speed: 0.5"

    def place(region: Region) -> str:
        row, col = world.position(region)
        return f"[{row}, {col}]"

    return f"""\
# yaml-language-server: $schema=safenav.schema.json
safenav: 1
name: {json.dumps(name)}
# Regions are [row, column] from the north-west, or numbers; 'safenav draw' shows them.
map:
{body}
  names: {{home: {place(home)}, away: {place(away)}, dock: {place(dock)}, yard: {place(far)}}}

# 'safenav new --catalogue' lists the built-in models and obstacle types. This adds a model.
catalogue:
  robots:
    rover: {{mobility: free, layer: ground, capabilities: [push]{body_of}}}

robots:
  scout: {{model: {flyer}, start: home, objective: {{patrol: [home, away]}}}}
  rover: {{model: rover, start: dock, objective: {{visit: [yard, dock]}}}}

# Present, but unknown until a robot discovers it; uncomment these lines and run it again:
# obstacles:
#   - {{type: door, region: {place(away)}}}

until: {{rounds: 1}}
expect: {{outcome: completed}}
"""


def _written(value: str | float) -> str:
    """Return a number, or the path of a file, as YAML."""
    if not isinstance(value, str):
        return f"{value:.15g}"
    return value if re.fullmatch(r"[\w./][\w./-]*", value) else json.dumps(value)


def _farthest(world: RegionMap, region: Region) -> Region:
    """Return the most distant connected region; among equals, the lowest."""
    depth = world.distances([region])
    return min(depth, key=lambda other: (-depth[other], other))
