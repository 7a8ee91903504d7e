"""An operator in a live run: the run waits, proposes repairs, and continues after interventions."""

import json
import time
from itertools import pairwise
from pathlib import Path
from threading import Event
from typing import Any

import pytest
from msgspec.structs import replace

import warm
from runtime.facts import case
from runtime.played import Run, begin, end, loaded, whole
from runtime.worlds import Clocked, Remote
from safenav.errors import UsageError
from safenav.outcome import Outcome
from safenav.runtime.intervention.kinds import AddObstacle
from safenav.runtime.intervention.reading import read_intervention
from safenav.runtime.run.mission import Mission
from safenav.runtime.worlds.protocol import Failed, Lost, Sensed
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.synthesis.request import SynthesisResult
from safenav.synthesis.slugs import Synthesizer
from safenav.team.apply import rounds
from safenav.world.moves import Pose

GATE = case("operator/gate")
NAMED = GATE.replace("]}\ncatalogue", "], names: {doorway: [2, 5]}}\ncatalogue")


def test_a_request_given_up_and_resolved_is_not_reopened_when_its_obstacle_is_back() -> None:
    """The cart met the gate the first time, the bee the second time: the cart waits for nothing."""
    east = GATE.replace("air", "ground").replace("[[2, 8], [2, 1]]", "[[2, 8], [3, 8]]")
    mission, run = begin(east, attended=True)
    while not (mission.waiting is not None and mission.still):
        mission.step()
    mission.intervene(read_intervention("resolved gate@27", mission.scenario))
    while not run.all("goal", robot="bee"):
        mission.step()
    gate = mission.scenario.obstacles[0]
    mission.intervene(AddObstacle(gate.type, gate.region))
    while not (mission.waiting is not None and mission.still):
        mission.step()
    mission.intervene(read_intervention("service cart out", mission.scenario))
    mission.step()
    mission.intervene(read_intervention("give_up", mission.scenario))
    end(mission, run)
    assert run.one("reopened")["obstacle"] == "gate@27"
    assert [line["requester"] for line in run.all("request")] == ["cart", "bee", "bee"]
    assert not run.findings


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("resolved door@9", "the team knows no obstacle 'door@9'; known: gate@27"),
        ("put_back cart [0, 0]", "is a wall"),
        ("put_back cart [2, 5]", "gate@27 is in region 27: resolve it first"),
        ("put_back cart 999", "region 999"),
        ("put_back cart [1, 1] north", "cart has no heading"),
        ("put_back rover [1, 1]", "no robot rover"),
        ("service cart away", "expected: service ROBOT out|back"),
        ("give_up now", "expected: give_up; found 'give_up now'"),
        ("open gate@27", "unknown intervention 'open'"),
        ("  ", "unknown intervention"),
        ("objective cart {visit: [1}", "is not valid YAML"),
        ("objective cart " + "{a: " * 3000, "nested more than 50 deep"),
        (
            "objective cart {a: &a [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]"
            + "".join(f", {n}: &{n} [{', '.join([f'*{b}'] * 10)}]" for b, n in pairwise("abcdefgh"))
            + "}",
            "more than 100000 values",
        ),
    ],
)
def test_an_impossible_intervention_is_refused(line: str, message: str) -> None:
    mission, _ = begin(GATE, attended=True)
    while mission.waiting is None:
        mission.step()
    with pytest.raises(UsageError) as error:
        mission.intervene(read_intervention(line, mission.scenario))
    assert message in str(error.value)


def test_no_robot_is_put_into_what_has_been_found_untraversable() -> None:
    """It has no further need, and is closed to the robots that it blocks."""
    truth = GATE.replace("action: push, resolve_at: self,", "action: look, has_truth: true,")
    truth = truth.replace("air, capabilities: []", "air, capabilities: [look]")
    mission, run = begin(truth.replace("[2, 5]}]", "[2, 5], traversable: false}]"), attended=True)
    while mission.waiting is None:
        mission.step()
    assert run.one("resolved")["traversable"] is False
    with pytest.raises(UsageError, match="gate@27 is in region 27: resolve it first"):
        mission.intervene(read_intervention("put_back cart [2, 5]", mission.scenario))


def test_a_proof_holds_after_moves_during_the_wait() -> None:
    """A robot that pursues its own objective continues, and the run is given up: the poses with
    which its proof begins are those at the begin of the wait."""
    mission, run = begin(GATE, attended=True)
    while not run.all("waiting") or len(run.all("goal", robot="bee")) < 5:
        mission.step()
    mission.intervene(read_intervention("give_up", mission.scenario))
    end(mission, run)
    assert run.outcome["outcome"] == "operator_needed"
    assert run.outcome["rounds"]["bee"] > 1
    run.outcome["proof"]["robots"]["cart"]["poses"].pop()
    assert "negative" in run.broken


@pytest.mark.parametrize(
    ("fixes", "code", "told"),
    [
        ("resolved gate@doorway\n\npush it\n", 2, "error: {}:3: 'push it' is not an intervention"),
        ("push\x1b[31m it\n", 2, "error: {}:1: 'push?[31m it' is not"),
        (  # read before the run
            "resolved gate@27\n\nput_back cart [0, 0]\n",
            2,
            "error: {}:3: 'region': region 0 [0, 0] is a wall",
        ),
        (  # ``#2`` is not a comment
            "resolved gate@doorway#2 # the second\nresolved gate@doorway\n",
            0,
            "{}:1: dropped: the team knows no obstacle 'gate@doorway#2'; known: gate@doorway",
        ),
        ("resolved gaet@doorway\n", 2, "error: {}:1: there is no obstacle type 'gaet'; known: "),
        (
            "# opened\nresolved gate@doorway\n\ngive_up\n\nservice bee out\nresolved gate@27\n",
            0,
            "note: the run ended before {}:4: give_up and 2 more\n",
        ),
    ],
    ids=["unknown", "control", "wall", "not there", "misspelt", "more than needed"],
)
def test_interventions_are_read_from_a_file(
    fixes: str, code: int, told: str, tmp_path: Path
) -> None:
    scenario, file, trace = (tmp_path / name for name in ("gate.yaml", "fixes.txt", "t.jsonl"))
    scenario.write_text(whole(NAMED))
    file.write_text(fixes)
    done = warm.safenav("run", scenario, "--operator", file, "--trace", trace)
    assert done.returncode == code
    assert told.format(file) in done.stderr
    if told.startswith("error"):  # before it began
        assert done.stdout == "" and not trace.exists()
    else:
        outcome = json.loads(trace.read_text().splitlines()[-1])["outcome"]
        assert outcome == ("interrupted" if code else "completed")
    if not code:
        done = warm.safenav("certify", "--trace", trace, "-o", tmp_path / "bundle")
        assert done.returncode == 0, done.stderr


def test_the_terminal_prints_the_reason_of_a_wait(tmp_path: Path) -> None:
    scenario = tmp_path / "gate.yaml"
    scenario.write_text(GATE)
    typed = "open it\nresolved gate@27\n\n"
    done = warm.safenav("run", scenario, "--operator", "-", "--no-map", text=typed)
    assert done.returncode == 0
    assert "because gate@27 needs a robot with 'push'" in done.stderr
    assert "unknown intervention 'open'" in done.stderr
    assert "an operator intervenes: resolved gate@27" in done.stdout


OPEN = GATE.replace("obstacles: [{type: gate, region: [2, 5]}]\n", "").replace("air", "ground")


def losing_the_cart(text: str, *regions: int, service: str = "") -> tuple[Mission, Run, Scenario]:
    """A mission whose world has lost the cart on its way: in these regions, or at either end.
    ``service``: what an operator says before."""
    scenario = loaded(text)
    world = Remote(scenario)
    mission, run = begin(scenario, world=world, attended=True)
    while mission._run.state.robots[0].to is None or mission.tick < 6:
        mission.step()
    if service:
        mission.intervene(read_intervention(service, scenario))
        mission.step()
    cart, size = mission._run.state.robots[0], scenario.map.size
    places = frozenset(regions or (cart.pose % size, cart.next % size))
    number = mission._world.commands.number("cart")
    mission.post(Lost(world.now(), "cart", places, "no signal", command=number))
    world.simulation._coming = [c for c in world.simulation._coming if c[3].name != "cart"]
    return mission, run, scenario


def test_a_report_of_absence_changes_no_wait() -> None:
    """A sensor that looks often would have it decided again as often."""
    scenario = loaded(GATE)
    mission, run = begin(scenario, world=Remote(scenario), attended=True)
    while mission.waiting is None or not mission.still:
        mission.step()
    elsewhere = replace(scenario.obstacles[0], region=23)
    mission.post(Sensed(mission._world.commands.now(), elsewhere, there=False))
    mission.step()
    assert len(run.all("waiting")) == 1 and not run.all("reopened")


def test_a_robot_that_is_out_of_service_may_be_lost() -> None:
    """By an operator, while it was on its way: its regions are closed all the same."""
    mission, run, scenario = losing_the_cart(OPEN, service="service cart out")
    while mission.waiting is None or not mission.still:
        mission.step()
    assert run.one("discovered")["obstacle"]["name"] == "lost_cart@26"
    mission.intervene(read_intervention("give_up", scenario))
    end(mission, run)


def test_a_lost_robot_is_put_back() -> None:
    """No robot goes where it may be, until an operator has put it down."""
    mission, run, scenario = losing_the_cart(OPEN)
    while mission.waiting is None or not mission.still:
        mission.step()
    assert run.one("service", robot="cart")["cause"] == "world"
    with pytest.raises(UsageError, match="give its position"):
        mission.intervene(read_intervention("service cart back", scenario))
    mission.intervene(read_intervention("put_back cart [3, 2]", scenario))
    mission.intervene(read_intervention("service cart back", scenario))
    end(mission, run)
    assert run.outcome["outcome"] == "completed"
    assert run.one("gone")["obstacle"] == "lost_cart@26"


@pytest.mark.parametrize("at_once", [True, False])
def test_a_region_that_an_operator_resolves_is_excluded_for_a_lost_robot(*, at_once: bool) -> None:
    """The bee may go there. A run given up immediately does not end for the resolution."""
    mission, run, scenario = losing_the_cart(OPEN.replace("[[1, 9], [1, 1]]", "[[2, 4], [1, 1]]"))
    while mission.waiting is None or not mission.still:
        mission.step()
    mission.intervene(read_intervention("resolved lost_cart@26", scenario))
    while not at_once and (mission.waiting is None or not run.all("depart", robot="bee", to=26)):
        mission.step()
    mission.intervene(read_intervention("give_up", scenario))
    end(mission, run)
    ends = ("interrupted", "given up") if at_once else ("operator_needed", "cart (its steps fail)")
    assert (run.outcome["outcome"], run.outcome["explanation"][: len(ends[1])]) == ends


def test_a_robot_lost_in_several_regions_is_put_back_by_one_decision() -> None:
    """No region where it is not counts as a closed one for another decision."""
    text = OPEN.replace("rounds: 1", "rounds: 4").replace("[[1, 9], [1, 1]]", "[[1, 2], [1, 1]]")
    mission, run, scenario = losing_the_cart(text, 24, 25, 26, 27)
    while not run.all("service", robot="cart"):
        mission.step()
    assert mission.waiting is None
    mission.intervene(read_intervention("put_back cart [3, 2]", scenario))
    end(mission, run)
    assert run.outcome["outcome"] == "completed"
    after = Run(run.records[run.records.index(run.one("operator")) :])
    assert len(after.all("gone")) == 3
    assert not after.all("blocked") and not after.all("reopened")


def test_a_change_of_the_scenario_ends_a_wait_for_an_operator() -> None:
    """The cart no longer has anything to do behind the gate."""
    change = "changes: [{at: 8, robot: cart, objective: {visit: [[1, 1], [2, 1]]}}]\n"
    near = GATE.replace("[[1, 9], [1, 1]]", "[[1, 2], [1, 1]]")
    scenario, run = loaded(near + change), Run()
    mission = Mission(scenario, world=Clocked(scenario), listeners=[run], attended=True)
    mission.start()
    end = time.monotonic() + 300.0  # a step does not wait for a synthesis
    while mission.result is None and time.monotonic() < end:
        mission.step()
    assert mission.result is not None and mission.result.outcome is Outcome.COMPLETED
    assert len(run.all("waiting")) == 1
    assert not run.findings


class Gated(Synthesizer):
    """One that can be kept from answering."""

    def __init__(self) -> None:
        super().__init__()
        self.answers = Event()
        self.answers.set()

    def synthesize_all(self, *given: Any, **more: Any) -> list[SynthesisResult]:
        self.answers.wait()
        return super().synthesize_all(*given, **more)


def _rounds(mission: Mission) -> int:
    """The rounds that the cart has completed."""
    run = mission._run
    return rounds(run.team.members[0].objective, run.state.robots[0].own)


class Sudden(Clocked):
    """One in which a gate appears before the cart, which has done a round."""

    gate: Obstacle
    mission: Mission

    def sense(self, robot: Robot, region: int) -> Obstacle | None:
        done = robot.name == "cart" and _rounds(self.mission)
        return replace(self.gate, region=24) if done and region == 24 else None


def test_a_run_that_is_completed_waits_for_no_strategy() -> None:
    """The cart has done its round, and is to go around a gate; the bee does its own meanwhile."""
    text = GATE.replace("[[2, 8]", "[[2, 3]")
    scenario = loaded(text.replace("[[1, 9], [1, 1]]", "[[1, 1], [1, 3]]"))
    world, run, synthesizer = Sudden(scenario), Run(), Gated()
    (world.gate,) = scenario.obstacles
    mission = world.mission = Mission(scenario, synthesizer, world=world, listeners=[run])
    mission.start()
    for _ in range(1000):
        if _rounds(mission):
            synthesizer.answers.clear()
        if mission.result is None:
            mission.step()
    synthesizer.answers.set()
    assert mission.result is not None and mission.result.outcome is Outcome.COMPLETED
    assert run.all("violation") and run.all("hold", robot="cart", why="synthesis")
    assert not run.findings


def test_a_robot_that_fails_while_the_team_waits_is_in_the_reason_that_ends_the_run() -> None:
    """The first proof says that it cannot continue, which is not true of one out of service."""
    slow = GATE.replace("layer: air", "layer: ground, timing: 7")
    scenario = loaded(slow.replace("start: [1, 1]", "start: [3, 1]"))
    world = Remote(scenario)
    mission, run = begin(scenario, world=world, attended=True)
    while mission.waiting is None:
        mission.step()
    bee = mission._run.state.robots[1]
    assert bee.to is not None
    number = mission._world.commands.number("bee")
    here = Pose(bee.pose)
    mission.post(Failed(world.now(), "bee", here, "motor", fatal=True, command=number))
    world.simulation._coming = []
    mission.step()
    mission.intervene(read_intervention("give_up", scenario))
    while mission.result is None:
        mission.step()
    first, last = run.all("waiting")
    live = [line["proof"]["robots"]["bee"]["live"] for line in (first, last, run.outcome)]
    assert live == [False, True, True]
    assert not run.findings
