"""Worlds of a user's own: impossible answers and malformed reports name the call, make a robot lost
or are dropped; clocks, syntheses and monitors. What goes wrong in true reports is
``cases/failures`` and ``cases/outside``."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from threading import Event
from time import sleep
from typing import Any

import pytest
from msgspec.structs import replace

from runtime.facts import case
from runtime.played import Run, begin, completed, loaded, play
from runtime.worlds import Bare, Clocked, Driven, Faulty
from safenav import (
    Acted,
    ActResult,
    Arrived,
    Blocked,
    Change,
    Elsewhere,
    ExitCode,
    Failed,
    Heading,
    LiveSimulation,
    Lost,
    Mission,
    Need,
    Obstacle,
    Outcome,
    Pose,
    Robot,
    SafenavError,
    Scenario,
    Sensed,
    SimulatedWorld,
    Strategy,
    Synthesizer,
    SynthesizerError,
    Verdict,
    WorldEvent,
    built_in,
)
from safenav.runtime.control import answers

SCENARIO = """
map: {grid: ["#######", "#.....#", "#######"]}
robots:
  drone: {model: quadcopter, start: 8, objective: {visit: [12, 8]}}
inputs: {alarm: {at: 3}}
until: {rounds: 1}
"""
DOOR, FOG = built_in().obstacles["door"], built_in().obstacles["uncertainty"]
SAME = replace(DOOR, needs=(Need("push", same=True),))
TWO = replace(DOOR, needs=(Need("push"), Need("push", robots=2, same=True)))


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
        ("sense", says("a door"), r"'a door', which is invalid: .*; expected Obstacle \| None"),
        ("sense", says(Obstacle(DOOR, 99)), r"sense\('drone', 9\): door@99 is in a wall or off"),
        ("sense", says(Obstacle(DOOR, 11)), r"door@11 is not in the requested region"),
        ("sense", says(Obstacle("door", 9)), "which is invalid: `type` must be an object"),  # type: ignore[arg-type]
        ("sense", says(Obstacle(DOOR, 9, resolve_within=-4)), "invalid: `resolve_within`"),
        ("sense", says(Obstacle(SAME, 9)), "region 9 has no previous need for 'same'"),
        ("sense", says(Obstacle(TWO, 9)), "as many robots for a 'same' need as for the"),
        ("inputs", says(None), r"World.inputs\(1\) failed: .* not values of inputs by name"),
        ("inputs", says({"alrm": True}), r"no input is named 'alrm'"),
        ("inputs", says({"alarm": "off"}), r"inputs\(1\) .* alarm is 'off', not True or False"),
        ("move", says(9), r"move\('drone', 9\): it returned 9, which is invalid"),
        ("move", says(Pose(400)), r"move\('drone', 9\): region 400 is a wall or off the map"),
        ("move", says(Pose(8.0)), "which is invalid: `region` must be a whole number"),  # type: ignore[arg-type]
        ("move", says(Pose(9, Heading.EAST)), "drone is a robot of free mobility"),
        ("act", generates, r"World.act\('drone'\) failed: OSError: no more"),
        ("act", says(None), r"returned None, .*; expected list\[tuple\[Obstacle, bool \| None\]\]"),
        ("act", says([Obstacle(FOG, 10)]), r"is invalid: `\[0\]` must be a list, not an object"),
        ("act", says([(Obstacle(FOG, 10), "yes")]), r"`\[0\]\[1\]` must be true or false or null"),
        ("act", says([(Obstacle(DOOR, 9), None)]), r"drone cannot 'push' door@9"),
        ("act", says([(Obstacle(FOG, 12), True)]), r"drone is at 8; .* can be resolved at 11"),
        ("changes", says([Obstacle(DOOR, 9)]), r"World.changes\(1\): .* is invalid"),
        ("changes", says([Change(Obstacle(DOOR, 8), True)]), "door@8 appears where a robot is"),
    ],
)
def test_an_inconsistent_world_ends_the_run_with_an_error_and_the_reason(
    call: str, answer: Callable[..., Any], told: str
) -> None:
    scenario, run = loaded(SCENARIO), Run()
    world = (Driven if call == "act" else SimulatedWorld)(scenario)
    setattr(world, call, answer)
    with pytest.raises(SafenavError, match=told) as caught:
        Mission(scenario, world=world, listeners=[run]).run()
    assert caught.value.exit_code is ExitCode.INTERNAL
    assert run.outcome is run.records[-1]
    assert run.outcome["outcome"] == "error" and call in run.outcome["explanation"]
    assert not run.findings


RING = case("failures/ring")


def patient(text: str, timeout: float) -> Scenario:
    """A scenario with this patience."""
    scenario = loaded(text)
    return replace(scenario, failures=replace(scenario.failures, timeout=timeout))


UP: Any = "up"
NOW: Any = "now"
MALFORMED: list[tuple[str, Callable[[Arrived], Any], str]] = [
    ("lost", lambda e: Elsewhere(e.at, "a", Pose(9, UP), command=e.command), "`pose.heading` must"),
    ("lost", lambda e: Failed(e.at, "a", None, "", command=e.command), "`pose` must be an object"),  # type: ignore[arg-type]
    ("lost", lambda e: Lost(e.at, "a", frozenset(), command=e.command), "names no region"),
    ("lost", lambda e: Arrived(NOW, "a", command=e.command), "its time is 'now', not seconds"),
    ("lost", lambda e: Arrived(math.nan, "a", command=e.command), "its time is nan, not seconds"),
    (
        "lost",
        lambda e: Blocked(e.at, "a", Pose(9), Obstacle(DOOR, 26), command=e.command),
        "blocked by door@26, which is not in region 10",
    ),
    ("lost", lambda e: Blocked(e.at, "a", Pose(10), command=e.command), "not back in region 9"),
    ("lost", lambda e: Elsewhere(e.at, "a", Pose.of(9, "east"), command=e.command), "of free mob"),
    ("late", lambda e: Sensed(e.at, Obstacle(DOOR, 29), by="nobody"), "robot is named 'nobody'"),
    ("late", lambda e: Sensed(e.at, "door"), "`obstacle` must be an object"),  # type: ignore[arg-type]
    ("late", lambda _: Sensed(NOW, Obstacle(DOOR, 29), there=False), "its time is 'now'"),
    ("late", lambda _: "arrived", "'arrived' is not an event"),
    ("late", lambda e: Arrived(e.at, "a"), "the event names no command (command=, the number"),
    ("late", lambda e: Arrived(e.at, "a", command=str(e.command)), "`command` must be a whole"),  # type: ignore[arg-type]
]


@pytest.mark.parametrize(("end", "report", "reason"), MALFORMED)
def test_a_malformed_report_is_dropped_unless_it_ends_a_step(
    end: str, report: Callable[[Arrived], Any], reason: str
) -> None:
    """The robot of such a step is lost."""

    def told(event: Arrived) -> list[Any]:
        return [report(event), event][: 1 if end == "lost" else 2]

    run = play(RING, world=lambda scenario: Faulty(scenario, [["a", 2, told]]))
    if end == "lost":
        lost = run.one("arrive", result="lost")
        assert {9, 10} == {*lost["regions"]} and reason in lost["reason"]
        assert run.outcome["cause"] == "out_of_service"
        return
    assert run.outcome["outcome"] == "completed"
    (late,) = run.all("late")
    assert reason in late["reason"]
    of_a = "command" in reason
    assert (late["event"], late.get("robot")) == ("arrived", "a") or not of_a


@pytest.mark.parametrize("answer", [True, Pose(9)])
def test_a_command_with_a_malformed_reply_has_failed(answer: Any) -> None:
    class Answering(LiveSimulation):
        def start(self, robot: Robot, pose: Pose, command: int) -> Any:
            return answer if robot.name == "a" else super().start(robot, pose, command)

    run = play(RING, world=Answering)
    failed = run.one("arrive", robot="a", result="failed")
    assert "neither None nor an event" in failed["reason"]
    assert run.outcome["cause"] == "out_of_service"


@pytest.mark.parametrize(
    ("clock", "told"),
    [
        (says("12"), r"World.now\(\) returned '12', not seconds"),
        (says(10**400), r"World.now\(\) returned 1000"),
        (broken, r"World.now\(\) failed: RuntimeError: the radio is off"),
    ],
)
def test_a_clock_that_returns_no_time_is_reported(clock: Callable[[], Any], told: str) -> None:
    scenario = loaded(RING)
    world = LiveSimulation(scenario)
    world.now = clock  # type: ignore[method-assign]
    with pytest.raises(SafenavError, match=told):
        Mission(scenario, world=world).run()


def test_a_defect_of_the_simulation_is_not_a_failure_of_a_robot() -> None:
    scenario = loaded(RING)
    world = LiveSimulation(scenario)
    world.start = broken  # type: ignore[method-assign]
    with pytest.raises(RuntimeError, match="the radio is off"):
        Mission(scenario, world=world).run()


def test_a_robot_is_lost_even_if_its_world_cannot_cancel_the_command() -> None:
    class Deaf(Faulty):
        def cancel(self, robot: Robot) -> None:
            raise OSError(f"no connection to {robot.name}")

    world = Deaf(patient(RING, 20), [["a", None, "silent"]])
    reason = play(patient(RING, 20), world=world).one("arrive", result="lost")["reason"]
    assert reason.endswith("within 20.0 s of its cancellation (cancel: no connection to a)")


def test_a_mission_ends_if_no_time_passes() -> None:
    class Frozen(Bare):
        step = pause = 0.0

    outcome = play(SCENARIO.replace("rounds: 1", "rounds: 999"), world=Frozen()).outcome
    assert outcome["outcome"] == "search_limit" and "no time passes" in outcome["explanation"]


class SinceEpoch(Bare):
    """A clock of seconds since 1970 that advances only by waits: by nothing if they are short. No
    step ends before it is cancelled."""

    def __init__(self) -> None:
        super().__init__()
        self.time, self.waits = 1.7e9, 0

    def start(self, robot: Robot, pose: Pose, command: int) -> None:
        del robot, pose, command

    def wait(self, timeout: float | None) -> Sequence[WorldEvent]:
        self.waits += 1
        assert self.waits < 2000, f"no time passes in wait({timeout})"
        return super().wait(timeout)


@pytest.mark.parametrize("timeout", [1.1, 1.7])
def test_a_clock_that_advances_only_in_waits_reaches_the_time_limit(timeout: float) -> None:
    lost = play(patient(RING, timeout), world=SinceEpoch()).all("arrive", result="lost")
    assert {line["robot"] for line in lost} == {"a", "b"}
    assert [line["t"] for line in lost] == [pytest.approx(2 * timeout, abs=0.2)] * 2


def test_the_patience_is_at_least_a_second_if_steps_take_no_time(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """After a step that ended elsewhere, no robot is lost while all wait for another plan."""
    usual = answers.ask
    monkeypatch.setattr(answers, "ask", lambda *a, **k: sleep(0.05) or usual(*a, **k))  # type: ignore[func-returns-value]

    class Sudden(Bare):
        """Each seventh step takes half a second by the world's clock, the others nothing."""

        step, steps = 0.5, 0

        def start(self, robot: Robot, pose: Pose, command: int) -> WorldEvent | None:
            self.steps += 1
            if self.steps == 3:
                return Elsewhere(self.time, robot.name, pose, command=command)
            if self.steps % 7:
                return Arrived(self.time, robot.name, command=command)
            return super().start(robot, pose, command)

    world = Sudden()
    run = completed(RING, world=world)
    assert world.steps > 14 and not run.all("arrive", result="lost")


@pytest.mark.parametrize("result", ActResult)
def test_a_world_that_repeats_a_result_is_not_commanded_forever(result: ActResult) -> None:
    """It answers immediately, about what it was not asked to act on; no time passes meanwhile."""
    scenario, asked = loaded(case("outside/no_joint_action_in_transit")), list[str]()

    class Echo(LiveSimulation):
        def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> Any:
            del obstacles
            asked.append(robot.name)
            found = ((scenario.obstacles[0], result),)
            return Acted(self.now(), robot.name, found, command=command)

    run = play(scenario, world=Echo, lies=True)
    assert run.outcome["outcome"] == "completed"
    assert 0 < len(asked) <= 2 * len(run.all("arrive")) + 2 * len(scenario.robots)
    told = {line["reason"] for line in run.all("late")}
    assert told == {f"the result adds nothing to the team's knowledge (gate@18: {result.value})"}
    assert len(run.all("resolved")) == (result in (ActResult.DONE, ActResult.UNTRAVERSABLE))


@pytest.mark.parametrize(
    ("first", "told", "known"),
    [
        (OSError("no answer of its arm"), "act: no answer of its arm", True),
        (OSError("no answer of its arm"), "act: no answer of its arm", False),
        (Arrived(0.0, "b"), "Arrived ends no action", True),
        (Acted(0.0, "b", ("door",)), "it is invalid: `found[0]`", False),  # type: ignore[arg-type]
        (Acted(0.0, "b", reason="it jams"), "it jams", True),
        (None, "the command did not end within 10.0 s", False),
    ],
)
def test_the_trace_records_why_an_action_has_failed(
    first: WorldEvent | Exception | None, told: str, known: bool
) -> None:
    """Where the robot was to act on what the team knows, or where it starts; then it continues."""

    class Wrong(LiveSimulation):
        failed = False

        def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> Any:
            if robot.name != "b" or self.failed:
                return super().act(robot, obstacles, command)
            if known and not obstacles:
                return Acted(self.now(), "b", command=command)  # it sees nothing there yet
            self.failed = True
            if isinstance(first, Exception):
                raise first
            return first and replace(first, at=self.now(), command=command)

    run = completed(patient(case("failures/debris"), 5), world=Wrong)
    (failed,) = [line for line in run.all("acted") if "reason" in line]
    assert failed["robot"] == "b" and failed["reason"].startswith(told)
    assert failed["results"] == ({"debris@24": "failed"} if known else {})


def test_a_program_that_steps_a_mission_can_give_up() -> None:
    mission, run = begin(SCENARIO, world=Driven)
    for _ in range(3):
        mission.step()
    result = mission.give_up("battery low")
    assert mission.give_up("again") is mission.result is result
    last = run.records[-1]
    assert (last["outcome"], last["explanation"]) == ("interrupted", "battery low")
    assert not run.findings


def test_a_blocking_world_executes_a_step_of_several_ticks_at_its_start() -> None:
    scenario = loaded(case("outside/slow_step_ends_elsewhere"))
    world = Driven(scenario)
    mission, run = begin(scenario, world=world)
    mission.step()
    assert run.one("move", robot="slow")["toward"] == 27 and world.count["slow"] == 1


def test_orders_reach_the_team_in_a_world_of_the_user() -> None:
    class Outside(Driven):
        def act(self, robot: Robot) -> Any:
            self.truth.changes(10**6, ())  # ordered obstacles appear
            return super().act(robot)

    assert completed(case("orders/of_an_operator"), world=Outside).all("order")


def test_a_users_world_sets_inputs_regardless_of_their_schedule() -> None:
    class Caller(Driven):
        def inputs(self, tick: int) -> dict[str, bool]:
            return {"call": 6 <= tick <= 8, "alarm": False}

    fire = case("inputs/fire").replace("{at: [4-9, 20]}", "{}")
    lines = play(fire.replace("call: {}", "call: {at: 2-3}"), world=Caller).all("inputs")
    assert [(line["tick"], line["values"]["call"]) for line in lines] == [(6, True), (9, False)]


def test_a_run_in_which_no_robot_moves_waits_for_inputs_of_its_world() -> None:
    class Street(Bare):
        def inputs(self, tick: int) -> dict[str, bool]:
            del tick
            return {"green": self.time > 30.0, "alarm": 2.0 < self.time < 60.0}

    assert completed(case("inputs/green"), world=Street()).outcome["t"] >= 60.0


def test_the_judge_accepts_a_last_order_that_a_real_clock_delays_a_little() -> None:
    """A drive hears the time of an order at the next message, and ends in that pass."""
    run = completed(f"{case('waiting/order_left_open_only_at_the_end')}clock: live\n")
    last = [line["t"] for line in run.all("inputs")][-1]
    for record in run.records:
        if record.get("t", 0.0) >= last:
            record["t"] += 0.0003
    assert not run.findings


# Syntheses without an answer, or with a wrong one.


@pytest.fixture
def uncached(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SAFENAV_CACHE", "off")


@pytest.mark.usefixtures("uncached")
def test_a_run_continues_even_if_an_obsolete_synthesis_never_ends(tmp_path: Path) -> None:
    """The synthesizer does not answer from when a robot has seen the door that a person opens."""
    flag, slow = tmp_path / "flag", tmp_path / "slugs"
    slow.write_text(
        f'#!/bin/sh\n[ -e "{flag}" ] && exec sleep 1000\nexec "{Synthesizer().binary}" "$@"\n'
    )
    slow.chmod(0o755)
    scenario, run = loaded(case("outside/opened_during_the_action")), Run()
    world = Clocked(scenario)
    world.simulation, world.pauses = Faulty(scenario, opens=31), False

    seen: Any = lambda record: record.type == "violation" and flag.touch()  # noqa: E731
    synthesizer = Synthesizer(slow, seconds=None)
    Mission(scenario, synthesizer, world=world, listeners=[run, seen]).run()
    assert flag.exists() and run.one("gone")
    assert run.outcome["outcome"] == "completed" and not run.findings


def test_a_team_with_batteries_gets_its_next_plan_while_the_charges_change() -> None:
    """An order ends the first plan; the robots wait off the chargers until there is another one."""

    class Running(Clocked):
        pauses = False

        def wait(self, timeout: float | None) -> Sequence[WorldEvent]:
            sleep(0.005)
            return self.simulation.wait(timeout)

    text = case("energy/charges_until_the_next_order").replace("stay: 1", "stay: 0.01")
    scenario, run = loaded(f"{text}clock: live\nlimits: {{seconds: 900}}\n"), Run()
    Mission(scenario, world=Running(scenario), listeners=[run]).run()
    assert run.outcome["outcome"] == "completed" and not run.findings


def test_a_run_that_is_completed_waits_for_no_strategy() -> None:
    """The cart has done its round, and is to go around a gate that appears before it, while the
    synthesizer is kept from answering; the bee does its own meanwhile."""
    free = Event()

    class Gated(Synthesizer):
        def synthesize_all(self, *given: Any, **more: Any) -> Any:
            free.wait()
            return super().synthesize_all(*given, **more)

    def done() -> bool:
        return any(goal["round"] for goal in run.all("goal", robot="cart"))

    class Sudden(Clocked):
        pauses = False

        def sense(self, robot: Robot, region: int) -> Obstacle | None:
            appears = robot.name == "cart" and region == 24 and done()
            return replace(gate, region=24) if appears else None

    text = case("operator/gate").replace("[[2, 8]", "[[2, 3]")
    scenario, run = loaded(text.replace("[[1, 9], [1, 1]]", "[[1, 1], [1, 3]]")), Run()
    (gate,) = scenario.obstacles
    mission = Mission(scenario, Gated(), world=Sudden(scenario), listeners=[run])
    free.set()
    mission.start()
    for _ in range(1000):
        if done():
            free.clear()
        if mission.result is None:
            mission.step()
    free.set()
    assert mission.result is not None and mission.result.outcome is Outcome.COMPLETED
    assert run.all("violation") and not run.findings


@pytest.mark.usefixtures("uncached")
def test_without_a_strategy_the_run_ends_with_the_violated_assumption() -> None:
    """There is no other strategy for the bee than the first."""

    class Once(Synthesizer):
        def synthesize_all(self, specs: Any, *given: Any, **more: Any) -> Any:
            found = super().synthesize_all(specs, *given, **more)
            none = {"verdict": Verdict.UNREALIZABLE, "strategy": None}
            again = [spec.robot for spec in specs] == ["bee"]
            return [replace(result, **none) for result in found] if again else found

    scenario, run = loaded(case("outside/breaks_an_assumption")), Run()
    world = Driven(scenario, slides={"rover": {2: 22}})
    result = Mission(scenario, Once(), world=world, listeners=[run]).run()
    assert result.outcome is Outcome.ASSUMPTION_VIOLATED
    assert "stay, or step to a neighbouring region" in result.explanation
    assert run.all("assumption")


@pytest.mark.usefixtures("uncached")
def test_a_strategy_through_a_wall_is_stopped_before_the_wall() -> None:
    """The synthesizer answers as if there were no wall at 10, and claims that it is the answer."""

    class BlindToWalls(Synthesizer):
        def synthesize_all(self, specs: Any, *given: Any, **more: Any) -> Any:
            seen = [
                spec.without(c for c in spec.constraints if c.regions == (10,)) for spec in specs
            ]
            return [
                replace(result, strategy=Strategy.parse(result.strategy_json or b"", spec))
                for spec, result in zip(
                    specs, super().synthesize_all(seen, *given, **more), strict=True
                )
            ]

    around, run = SCENARIO.replace('"#.....#"', '"#..#..#", "#.....#"'), Run()
    synthesizer = BlindToWalls()
    with pytest.raises(SynthesizerError, match=r"drone leads from 9 .* to 10 ") as caught:
        Mission(loaded(around), synthesizer, listeners=[run]).run()
    assert caught.value.exit_code is ExitCode.INTERNAL
    assert [line["to"] for line in run.all("move")] == [9]
    assert run.outcome["outcome"] == "error"
