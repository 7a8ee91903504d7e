"""Live: an obstacle that is reported gone while a robot acts on it was not resolved by that."""

from collections.abc import Sequence

from msgspec.structs import replace

from runtime.played import play
from safenav.runtime.worlds.live_simulation import LiveSimulation
from safenav.runtime.worlds.protocol import Acted, Sensed, WorldEvent
from safenav.scenario.model import Obstacle, Robot
from safenav.scenario.reading.loader import load_scenario_text
from safenav.trace.vocabulary import ActResult

HALL = """\
safenav: 1
name: gone
clock: live
map: {grid: ["#########", "#...#...#", "#.......#", "#...#...#", "#########"]}
robots:
  spot: {model: fetch, start: [3, 7], objective: {visit: [[1, 5], [3, 7]]}}
  quad: {model: quadcopter, start: [2, 1], objective: {visit: [[2, 7], [2, 1]]}}
obstacles: [{type: sliding_door, region: [2, 4]}]
until: {rounds: 1}
"""


class Early(LiveSimulation):
    """A sensor sees that the door opens before the robot that opens it has answered."""

    def __init__(self) -> None:
        self.scenario = load_scenario_text(HALL, "gone.yaml")
        super().__init__(self.scenario)
        self.seen: list[Obstacle] = []
        self.told = 0

    def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> Acted | None:
        self.seen += obstacles
        return super().act(robot, obstacles, command)

    def wait(self, timeout: float | None) -> list[WorldEvent]:
        if self.seen and not self.told:
            self.told += 1
            self.truth.take_away(self.seen[0].name)
            self.truth.changes(0, ())
            return [Sensed(self.now(), self.seen[0], "quad", there=False)]
        done = [(obstacle, ActResult.DONE) for obstacle in self.seen]
        events = super().wait(timeout)
        return [replace(e, found=done) if isinstance(e, Acted) else e for e in events]


def test_an_obstacle_reported_gone_during_its_action_is_not_resolved() -> None:
    world = Early()
    run = play(world.scenario, world=world)
    types = [line["type"] for line in run.records]
    assert run.outcome["outcome"] == "completed" and world.told == 1
    assert types.count("gone") == 1 and types.count("acted") == 1 and "resolved" not in types
