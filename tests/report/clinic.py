"""A clinic with eighteen names, two areas, five robots, joint plans and requests."""

from pathlib import Path

from tests.warm import safenav

SCENARIO = """\
safenav: 1
name: clinic
map:
  grid: |
    #########################
    #.....#.....#.....#.....#
    #.....#.....#.....#.....#
    #.....#.....#.....#.....#
    ###.#####.#####.#####.###
    #.......................#
    #.......................#
    ###########...###########
    ###########...###########
    #.......................#
    #.......................#
    ###.#####.#####.#####.###
    #.....#.....#.....#.....#
    #.....#.....#.....#.....#
    #.....#.....#.....#.....#
    #########################
  names:
    pharmacy: [1, 1]
    laboratory: [1, 7]
    ward_b: [1, 22]
    kitchen: [14, 1]
    store: [14, 8]
    surgery: [14, 15]
    dock: [14, 22]
    lift: [8, 12]
    laboratory_door: [4, 9]
    surgery_door: [11, 15]
    nurses: [5, 5]
    reception: [9, 12]
    x_ray: [1, 10]
    theatre: [2, 2]
    laundry: [13, 5]
    waste: [13, 10]
    exit: [10, 23]
    chapel: [3, 10]
  resolution: 1.5
areas:
  ward_a: {rows: 1-3, columns: 13-17}
  corridor: [{rows: 9-10, columns: 16-23}]
catalogue:
  robots:
    tug:   {mobility: heading, layer: ground, capabilities: [], vision: 5, size: 0.7, speed: 0.8}
    nurse: {mobility: heading, layer: ground, capabilities: [open_door], size: 0.6, speed: 0.6}
    drone: {mobility: free, layer: air, capabilities: [look], size: 0.4, speed: 1.5}
  obstacles:
    fire_door: {action: open_door, resolve_at: neighbours, blocks: [ground]}
    spill:     {action: look, resolve_at: neighbours, has_truth: true, blocks: [ground]}
robots:
  tug_1: {model: tug, start: pharmacy, heading: east, objective: {patrol: [pharmacy, surgery]}}
  tug_2: {model: tug, start: kitchen, heading: east, objective: {visit: [kitchen, ward_a, ward_b]}}
  hugo:  {model: nurse, start: laboratory, heading: south, objective: {patrol: [laboratory, store]}}
  hanna: {model: nurse, start: dock, heading: west, objective: {hold: dock}}
  eye:   {model: drone, start: ward_b, objective: {cover: [ward_a, surgery, dock]}}
obstacles:
  - {type: fire_door, region: surgery_door}
  - {type: spill, region: lift, traversable: true}
  - {type: fire_door, region: laboratory_door}
until: {rounds: 1}
seed: 7
"""
NAMES = 20


def run(folder: Path) -> Path:
    """The trace of the clinic's run."""
    (folder / "clinic.yaml").write_text(SCENARIO)
    done = safenav("run", "clinic.yaml", "--trace", "clinic.jsonl", "--no-map", cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder / "clinic.jsonl"
