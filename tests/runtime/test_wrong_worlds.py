"""External worlds with impossible answers: a typed error names the call, and the trace ends."""

from collections.abc import Callable
from typing import Any

import pytest
from msgspec.structs import replace

from runtime.played import Run, loaded
from runtime.worlds import Driven
from safenav import Mission
from safenav.errors import ExitCode
from safenav.runtime.worlds.lockstep import WorldError
from safenav.runtime.worlds.protocol import Change
from safenav.runtime.worlds.truth import SimulatedWorld
from safenav.scenario.model import Need, Obstacle, Robot, Scenario
from safenav.scenario.reading.catalogue import built_in
from safenav.world.map import Heading
from safenav.world.moves import Pose

SCENARIO = """
map: {grid: ["#######", "#.....#", "#######"]}
robots:
  drone: {model: quadcopter, start: 8, objective: {visit: [12, 8]}}
inputs: {alarm: {at: 3}}
until: {rounds: 1}
"""
DOOR = built_in().obstacles["door"]
FOG = built_in().obstacles["uncertainty"]
SHUT = replace(DOOR, resolve_at=[8])
NOBODY = replace(DOOR, listed=(Need("push", robots=0),))
SAME = replace(DOOR, listed=(Need("push", same=True),))
TWO = replace(DOOR, listed=(Need("push"), Need("push", robots=2, same=True)))


def broken(*_: Any) -> Any:
    raise RuntimeError("the radio is off")


def generates(*_: Any) -> Any:
    yield Obstacle(FOG, 10), True
    raise OSError("no more")


def says(value: Any) -> Callable[..., Any]:
    return lambda *_: value


@pytest.mark.parametrize(
    ("call", "answer", "told"),
    [
        ("sense", broken, r"World.sense\('drone', 9\) failed: RuntimeError: the radio is off"),
        ("sense", says("a door"), r"World.sense\('drone', 9\): 'a door' is not an Obstacle"),
        ("sense", says(Obstacle(DOOR, 0)), r"sense\('drone', 9\): door@0 is in a wall or off"),
        ("sense", says(Obstacle(DOOR, 99)), r"sense\('drone', 9\): door@99 is in a wall or off"),
        ("sense", says(Obstacle(DOOR, 11)), r"door@11 is not in the requested region"),
        ("sense", says(Obstacle("door", 9)), r"region 9 has a wrong part: .*\$\.type"),  # type: ignore[arg-type]
        ("sense", says(Obstacle(SHUT, 9)), "region 9 has a list in place of a frozenset"),
        ("sense", says(Obstacle(NOBODY, 9)), r"wrong part: .* >= 1 - at .*robots"),
        ("sense", says(Obstacle(DOOR, 9, resolve_within=-4)), "wrong part: .* >= 0"),
        ("sense", says(Obstacle(FOG, 9, 1.5)), r"wrong part: .*`bool \| null`.*traversable"),
        ("sense", says(Obstacle(SAME, 9)), "region 9 has no previous need for 'same'"),
        ("sense", says(Obstacle(TWO, 9)), "other numbers of robots for a 'same' need"),
        ("inputs", broken, r"World.inputs\(1\) failed: RuntimeError"),
        ("inputs", says(None), r"World.inputs\(1\) failed: AttributeError"),
        ("inputs", says({"alarm": "off"}), r"inputs\(1\) .* alarm is 'off', not True or False"),
        ("move", broken, r"World.move\('drone', 9\) failed: RuntimeError: the radio is off"),
        ("move", says(9), r"World.move\('drone', 9\): it returned 9, which is neither a pose"),
        ("move", says(Pose(0)), r"move\('drone', 9\): region 0 is a wall or off the map"),
        ("move", says(Pose(400)), r"move\('drone', 9\): region 400 is a wall or off the map"),
        ("sense", says(Obstacle(FOG, 9.0)), r"region 9.0 of an obstacle is not an int"),  # type: ignore[arg-type]
        ("move", says(Pose(8.0)), r"World.move\('drone', 9\): region 8.0 is not an int"),  # type: ignore[arg-type]
        ("move", says(Pose(9, Heading.EAST)), "drone is a robot of free mobility"),
        ("act", broken, r"World.act\('drone'\) failed: RuntimeError"),
        ("act", generates, r"World.act\('drone'\) failed: OSError: no more"),
        ("act", says(7), r"World.act\('drone'\) failed: TypeError"),
        ("act", says([Obstacle(FOG, 10)]), "is not a pair of an obstacle and its truth"),
        ("act", says([("fog", True)]), r"act\('drone'\): 'fog' is not an Obstacle"),
        (
            "act",
            says([(Obstacle(FOG, 10), "yes")]),
            "'yes' is not true, false or None: whether uncertainty@10",
        ),
        ("act", says([(Obstacle(DOOR, 9), None)]), r"drone cannot 'push' door@9"),
        ("act", says([(Obstacle(FOG, 12), True)]), r"drone is at 8; .* can be resolved at 11"),
        ("changes", broken, r"World.changes\(1\) failed: RuntimeError"),
        ("changes", says([Obstacle(DOOR, 9)]), r"World.changes\(1\): .* which is not a Change"),
        ("changes", says([Change(Obstacle(DOOR, 0), True)]), "door@0 is in a wall or off the map"),
        ("changes", says([Change(Obstacle(DOOR, 8), True)]), "door@8 appears where a robot is"),
    ],
)
def test_an_inconsistent_world_is_an_error_with_its_reason(
    call: str, answer: Callable[..., Any], told: str
) -> None:
    scenario = loaded(SCENARIO)
    world = (Driven if call == "act" else SimulatedWorld)(scenario)
    setattr(world, call, answer)
    run = Run()
    with pytest.raises(WorldError, match=told) as caught:
        Mission(scenario, world=world, listeners=[run]).run()
    assert caught.value.exit_code is ExitCode.INTERNAL
    assert run.outcome is run.records[-1]
    assert run.outcome["outcome"] == "error" and call in run.outcome["explanation"]
    assert not run.findings


class Slippery(Driven):
    """The robot does not get where it is told: it stays for some moves (by their number, from 0:
    the first one is to its start), or slips back."""

    def __init__(self, scenario: Scenario, poses: dict[int, Pose]) -> None:
        super().__init__(scenario)
        self.poses = poses

    def move(self, robot: Robot, pose: Pose) -> Pose:
        pose = self.poses.get(self.moves, pose)
        super().move(robot, pose)
        return pose


@pytest.mark.parametrize(
    "poses",
    [{1: Pose(8), 2: Pose(8)}, {3: Pose(9)}, {2: Pose(10), 5: Pose(12), 6: Pose(12)}],
    ids=["stays at first", "slips back", "stays at the end"],
)
@pytest.mark.parametrize("coordination", ["resynthesis", "assignable"])
def test_a_robot_that_ends_elsewhere_continues_from_there(
    poses: dict[int, Pose], coordination: str
) -> None:
    scenario = loaded(SCENARIO + f"coordination: {coordination}\n")
    scenario = replace(scenario, obstacles=(Obstacle(FOG, 11, True),))
    run = Run()
    Mission(scenario, world=Slippery(scenario, poses), listeners=[run]).run()
    assert run.outcome["outcome"] == "completed", run.outcome
    moves = run.path("drone")
    for number, pose in poses.items():
        assert moves[number - 1] == pose.region
