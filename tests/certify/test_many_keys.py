"""Runs of scenarios with several keys at once that a checker once refused, though they were right.

Each was found by ``fuzz.mixed`` or its like, and made smaller.
"""

from pathlib import Path

import pytest
import yaml

from safenav.certify.record import bundle_of_run

MODELS = """
  robots:
    cart: {mobility: free, layer: ground, capabilities: []}
    clearer: {mobility: free, layer: ground, capabilities: [clear, look]}
    lifter: {mobility: free, layer: ground, capabilities: [clear, lift, look]}
    walker: {mobility: heading, layer: ground, capabilities: []}
    slow: {mobility: free, layer: ground, capabilities: [clear], timing: 2}
    charged: {mobility: free, layer: ground, capabilities: [lift],
              battery: {capacity: 12, charge: 1}}
    tired: {mobility: free, layer: ground, capabilities: [lift],
            battery: {capacity: 7, charge: 1}}
  obstacles:
    riddle: {action: look, resolve_at: neighbours, has_truth: true}
    crate: {needs: [{action: lift, robots: 2, at: neighbours, together: true}]}
    parcel: {needs: [{action: lift, at: [8]}, {action: lift, at: [7], same: true}], blocks: []}
    spill: {action: clear, blocks: []}
    empty: {needs: [{action: lift, at: neighbours}], blocks: []}
"""

ENTERED = "region' = AT & region != AT"
THIRD_TIME = f"""{{ltl: {{memory: {{c: [0, 2]}}, init: c = 0, safety: [
    {ENTERED} & c = 0 -> c' = 1, {ENTERED} & c = 1 -> c' = 2, {ENTERED} & c = 2 -> c' = 0,
    "!({ENTERED}) -> c' = c"], liveness: [c = 2 & region = TO]}}}}"""
"""To be at TO when it has entered AT two times more, of each three."""

CASES = {
    "a refused charge follows from the rules of its objective": """
map: {grid: ["######", "#....#", "######"]}
robots:
  r: {model: charged, start: 8,
      objective: {once: [10, 8], always: "region = 10 -> region' != 9"}}
chargers: []
""",
    "a target counts in the turn in which a wait begins": """
map: {grid: ["######", "##...#", "#.#..#", "######"]}
robots: {r: {model: clearer, start: 8, objective: {visit: [10, 16, 9]}}}
obstacles: [{type: riddle, region: 16, traversable: false}]
orders: [{at: 8, type: spill, region: 13}]
""",
    "one that goes to charge helps after that": """
map: {grid: ["######", "#....#", "##...#", "######"]}
robots:
  r0: {model: cart, start: 8, objective: {once: [14]}}
  r1: {model: charged, start: 14, objective: {once: [{any: [7, 8, 16]}]}}
orders: [{at: 8, type: parcel, region: 8}]
chargers: [15]
""",
    "one that charges is asked for a battery": """
map: {grid: ["#######", "#....##", "#.....#", "#######"]}
robots:
  r0: {model: tired, start: 11,
       objective: {visit: [{any: [9, 10, 15]}, 19, {any: [11, 16, 17]}]}}
  r1: {model: charged, start: 16, objective: {visit: [19, 16]}}
chargers: [16]
flat: empty
""",
    "one whose objective an input has changed waits for a strategy": """
map: {grid: ["######", "#..#.#", "#....#", "#..#.#", "######"]}
robots:
  r0: {model: slow, start: 19, objective: {once: [{any: [8, 10, 16]}]},
       when: {alarm: {visit: [13]}}}
  r1: {model: cart, start: 10, objective: {hold: 16}}
obstacles: [{type: riddle, region: 16, traversable: false}]
inputs: {alarm: {at: ["2-4"]}}
""",
    "one whose objective was refuted stays while the team waits": """
map: {grid: ["#####", "#...#", "#...#", "#####"]}
robots:
  r0: {model: clearer, start: 13, objective: {once: [12, 11, 8]}}
  r1: {model: lifter, start: 12, objective: {visit: [6, 7]}}
  r2: {model: walker, start: 7, heading: north, objective: {once: [{any: [7, 8, 11]}, 13]}}
obstacles: [{type: crate, region: 11}]
changes: [{at: 14, robot: r2, service: back}]
""",
    "an objective serves an order whose push follows": """
map: {grid: ["#####", "#...#", "#.###", "#####"]}
robots: {r: {model: lifter, start: 11, objective: {once: [7, 8, {any: [6, 7, 11]}]}}}
obstacles: [{type: riddle, region: 6, traversable: false}]
orders: [{at: 7, type: spill, region: 11}, {at: 1, type: spill, region: 6}]
""",
    "a mission is not lost while an input brings its objective back": """
map: {grid: ["#####", "##..#", "#...#", "#..##", "#####"]}
robots: {r: {model: cart, start: 17, objective: {visit: [16]}, when: {alarm: {visit: [12, 13]}}}}
obstacles: [{type: crate, region: 12}]
orders: [{at: 2, type: parcel, region: 13}]
inputs: {alarm: {at: ["2-4"]}}
until: {rounds: 1, by: 28}
""",
    "a step ends under the objective that came while it was made": """
map: {grid: ["#######", "#...###", "##...##", "#######"]}
robots: {r: {model: slow, start: 8, objective: {circuit: [10, 9, 17]},
             when: {alarm: {visit: [10, 16]}}}}
inputs: {alarm: {at: ["2-4"]}}
""",
    "an objective is back on the way, and a strategy that suffices is kept": """
map: {grid: ["....", "####"]}
robots: {r: {model: slow, start: 2, objective: {patrol: [1, 3]}, when: {alarm: {visit: [1, 3]}}}}
inputs: {alarm: {at: ["1-3"]}}
until: {rounds: 2}
""",
    "one robot can close several regions of a zone": """
map: {grid: ["..####..", "........", "..####.."]}
robots:
  r0:
    model: cart
    start: 7
    objective:
      ltl:
        memory: {m: bool}
        init: "!m"
        safety: ["region' = 13 -> m'", "region' = 12 -> !m'", "m -> region' != 13",
                 "region' != 13 & region' != 12 -> (m' <-> m)"]
        liveness: [region = 13, region = 12]
  r1: {model: cart, start: 0, objective: {visit: [8]}}
never_together: [{robots: [r0, r1], in: [{any: [17, 13]}]}]
""",
    "a joint plan has a robot remember what its strategy never does there": f"""
map: {{grid: ["......", "#.##.#", "......"]}}
robots:
  r0: {{model: cart, start: 0, objective: {THIRD_TIME.replace("AT", "4").replace("TO", "7")}}}
  r1: {{model: cart, start: 13, objective: {THIRD_TIME.replace("AT", "3").replace("TO", "4")}}}
seed: 23
""",
    "inputs of formulas may be such that a robot cannot continue": """
map: {grid: ["....", "...."]}
robots:
  r0: {model: walker, start: 7, heading: north,
       objective: {ltl: {liveness: [region = 1, alarm -> region = 2]}}}
obstacles: [{type: crate, region: 6}]
inputs: {alarm: {at: ["2-6"]}}
""",
    "a robot cannot leave a region immediately while others may stand around it": """
map: {grid: ["...", "...", "..."]}
robots:
  r0: {model: walker, start: 6, heading: south,
       objective: {ltl: {safety: region = 8 -> region' != 8, liveness: [region = 2, region = 7]}}}
  r1: {model: cart, start: 3, objective: {visit: [6, 3]}}
obstacles: [{type: crate, region: 4}]
until: {rounds: 2}
""",
}


@pytest.mark.parametrize("clock", ["lockstep", "live"])
@pytest.mark.parametrize("name", CASES)
def test_the_run_is_certified(name: str, clock: str, tmp_path: Path) -> None:
    scenario = tmp_path / "scenario.yaml"
    text = f"safenav: 1\nclock: {clock}\ncatalogue:{MODELS}{CASES[name]}"
    data = yaml.safe_load(text)
    if clock == "live":
        data.get("until", {}).pop("by", None)
    types = data["catalogue"]["obstacles"]
    data["catalogue"]["obstacles"] = {t: types[t] for t in types if t in CASES[name]}
    data["limits"] = {"ticks": 400}
    scenario.write_text(yaml.safe_dump(data))
    assert bundle_of_run(scenario, tmp_path / "bundle").verdict.accepted
