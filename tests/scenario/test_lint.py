"""Warnings about a valid scenario that is probably mistaken."""

from pathlib import Path

import pytest

import warm
from safenav.scenario.lint import imprecise, lint
from safenav.scenario.reading.loader import load_scenario, load_scenario_text

SCENARIO = """
safenav: 1
map: {{grid: ["########", "#......#", "#......#", "########"], names: {names}}}
catalogue:
  robots:
    porter: {{mobility: free, layer: {layer}, capabilities: [{can}]}}
{more}  obstacles:
    beam: {{needs: [{{action: lift, robots: {robots}, at: neighbours}}]}}
    leak: {{action: lift, blocks: []}}
robots:
  a: {{model: porter, start: 9, objective: {{visit: [14, 9]}}}}
  b: {{model: {other}, start: 17, objective: {{visit: [22, 17]}}, avoids: {avoids}}}
obstacles: {obstacles}
seed: {seed}
"""
PLAIN = {
    "can": "lift",
    "layer": "ground",
    "more": "",
    "timing": "",
    "robots": "1",
    "other": "quadcopter",
    "avoids": "[]",
    "obstacles": "[{type: beam, region: 11}]",
    "seed": "0",
    "names": "{}",
}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        pytest.param({}, [], id="nothing"),
        pytest.param(
            {"more": "    qaudcopter: {mobility: free, layer: air, capabilities: []}\n"},
            ["robot model 'qaudcopter' is not used, 'quadcopter' of the built-in catalogue is"],
            id="a model of its own that is misspelt",
        ),
        pytest.param(
            {"layer": "groud"},
            ["layer 'groud' of porter; did you mean 'ground'?"],
            id="a layer that is misspelt",
        ),
        pytest.param(
            {"can": "lfit"},
            [
                "porter can 'lfit', which no obstacle needs; did you mean 'lift'?",
                "no robot can resolve beam@11: it needs 'lift'; available: 'lfit', 'sense'; "
                "did you mean 'lfit'?",
            ],
            id="a slip of the pen",
        ),
        pytest.param(
            {"robots": "2"},
            ["no team can resolve beam@11: 'lift' takes 2 robots, and only a can do it"],
            id="too few",
        ),
        pytest.param(
            {"robots": "2", "names": "{gate: 11}"},
            ["no team can resolve beam@gate: 'lift' takes 2 robots, and only a can do it"],
            id="too few, at a region with a name",
        ),
        pytest.param(
            {"robots": "1, at: neighbours}, {action: sense, same: true"},
            [
                "no robot can resolve beam@11: the robot that fulfils need 1 must have 'lift' and "
                "'sense' ('same'), and no robot has both"
            ],
            id="a load that no robot can take and put down",
        ),
        pytest.param({"robots": "2", "other": "porter"}, [], id="enough"),
        pytest.param(
            {"can": "lift, push"}, ["porter can 'push', which no obstacle needs"], id="needless"
        ),
        pytest.param({"obstacles": "[]"}, [], id="a type that a drive may find"),
        pytest.param(
            {"can": "lift, swap", "obstacles": "[]\nflat: flat_battery"}, [], id="a flat battery"
        ),
        pytest.param(
            {"seed": "7"},
            ["seed 7 has no effect: no robots share a floor"],
            id="a seed for nothing",
        ),
        pytest.param({"seed": "7", "avoids": "[a]"}, [], id="a shared floor"),
        pytest.param(
            {"seed": "7\nnever_together: [{robots: [a, b], in: [12]}]"},
            [],
            id="robots of two layers that wait for each other",
        ),
        pytest.param(
            {
                "obstacles": "[{type: leak, region: 11}]",
            },
            ["no robot encounters leak@11, because it blocks none; list it under 'orders'"],
            id="an obstacle that blocks no robot",
        ),
        pytest.param(
            {"names": "{}, resolution: 0.4"},
            [
                "b (quadcopter, 0.5 m) is larger than a region (0.4 m) and reaches into the next "
                "ones, where other robots may be; give the map larger regions"
            ],
            id="a robot larger than a region",
        ),
        pytest.param(
            {"names": "{}, resolution: 0.5"},
            [
                "b (quadcopter, flyer, 0.5 m) has no room to move in a region (0.5 m): its "
                "motion needs 0.6 m; give the map larger regions"
            ],
            id="a robot as large as a region",
        ),
        pytest.param({"names": "{}, resolution: 0.6"}, [], id="a robot with room"),
    ],
)
def test_warnings(changes: dict[str, str], said: list[str], tmp_path: Path) -> None:
    file = tmp_path / "s.yaml"
    file.write_text(SCENARIO.format(**PLAIN | changes))
    assert list(lint(load_scenario(file))) == said


@pytest.mark.parametrize(
    ("model", "side"), [("digit", 1.79), ("digit", 1.8), ("husky", 1.29), ("husky", 1.3)]
)
def test_what_has_no_room_is_what_motion_refuses(model: str, side: float, tmp_path: Path) -> None:
    scenario, trace = tmp_path / "s.yaml", tmp_path / "t.jsonl"
    scenario.write_text(
        f'safenav: 1\nmap: {{resolution: {side}, grid: ["####", "#..#", "#..#", "####"]}}\n'
        f"robots: {{a: {{model: {model}, start: 5, heading: east, objective: {{hold: 6}}}}}}\n"
        "until: {rounds: 1}\n"
    )
    assert warm.safenav("run", scenario, "--trace", trace).returncode == 0
    done = warm.safenav("export", trace, "-o", tmp_path / "m.jsonl")
    assert (done.returncode == 2) == any(
        "has no room" in told for told in lint(load_scenario(scenario))
    )
    assert (done.returncode == 2) == (side in (1.79, 1.29))


@pytest.mark.parametrize(
    ("side", "off", "said"),
    [
        (2.0, 0.7, None),
        (1.0, 0.3, "reaches 0.10 m into the next one, where other robots may be; set its"),
        (0.6, 0.3, "reaches 0.30 m into the next one, where other robots may be; give the map"),
        (0.5, 0.3, None),  # larger than a region, which is said
    ],
)
def test_a_robot_that_arrives_beside_the_middle_reaches_into_the_next_region(
    side: float, off: float, said: str | None
) -> None:
    text = f"""
safenav: 1
map: {{resolution: {side}, grid: ["####", "#..#", "####"]}}
catalogue: {{robots: {{cart: {{mobility: free, layer: ground, size: 0.6, speed: 1}}}}}}
robots: {{a: {{model: cart, start: 5, objective: {{visit: [6, 5]}}}}}}
"""
    found = list(imprecise(load_scenario_text(text), {"a": off}))
    assert (said in found[0]) if said else not found
