"""The story of a run on the terminal: the sentences of all other outputs, and its own frame."""

import click
import pytest

from once import beside
from safenav.errors import Verdict
from safenav.report.terminal import story
from safenav.report.terminal.story import Story, syntheses_words
from safenav.scenario.model import OPERATOR_ACTION, Obstacle, ObstacleType
from safenav.scenario.reading.loader import load_scenario_text
from safenav.trace import records, vocabulary
from safenav.trace.fields import objective_of
from safenav.trace.file import unstarted

ROOM = beside(__file__, "scenarios/room.yaml")


def told(*lines: records.Record, heading: str = "north", text: str = ROOM) -> list[str]:
    """What the story says of these lines."""
    said: list[str] = []
    scenario = load_scenario_text(text.replace("heading: north", f"heading: {heading}"))
    story = Story(scenario, lambda line: said.append(click.unstyle(str(line))), maps=False)
    for line in lines:
        story(line)
    return said


def test_names_are_marked_wherever_they_stand() -> None:
    said: list[str] = []
    tell = Story(load_scenario_text(ROOM), lambda line: said.append(str(line)), maps=False)
    tell(records.Request(3, "door@9", "quad", {"digit": 1}, ("digit",)))
    quad, digit = click.style("quad", fg="cyan"), click.style("digit", fg="yellow")
    door = click.style("door@gate", bold=True)
    assert said[0].endswith(
        f"  {quad} requests help with {door}: {digit} needs 1 tick; {digit} helps"
    )


@pytest.mark.parametrize(("most", "drawn"), [(24, 2), (23, 1)])
def test_a_large_map_is_drawn_once(most: int, drawn: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run on 256 x 256 regions printed 256 kB at each request."""
    monkeypatch.setattr(story, "LARGE", most)
    said: list[str] = []
    scenario = load_scenario_text(ROOM)
    tell = Story(scenario, lambda line: said.append(click.unstyle(str(line))))
    tell(unstarted(scenario).header)
    tell(records.Move(1, "quad", 7, 8, None))
    tell(records.Gone(1, "door@9", vocabulary.ChangeCause.WORLD))
    assert sum("██" in line for line in said) == drawn * 4


def failure(obstacle: str) -> list[records.Record]:
    """Lines of a robot that is lost, or cannot go on."""
    about = Obstacle(ObstacleType(obstacle.partition("@")[0], OPERATOR_ACTION), 9)
    met = records.Violation(2, "quad", 8, 9, obstacle, OPERATOR_ACTION)
    return [records.Discovered(2, about), met]


def ended(reason: str) -> list[records.Record]:
    failed = {"door@9": vocabulary.ActResult.FAILED}
    return [records.ActionEnd(4, 1, "quad", failed, None, reason)]


def lost(earliest: int | None) -> list[records.Record]:
    return [records.Deadline(4, "door@9", 15, vocabulary.DeadlineVerdict.LOST, earliest)]


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (
            failure("unknown_air@9"),
            "quad at 8 [1, 2] cannot enter gate 9 [1, 3], which counts as unknown_air@gate: only "
            "an operator can resolve it",
        ),
        (failure("lost_quad@9"), "quad at 8 [1, 2] is lost: it may also be at gate 9 [1, 3]"),
        (ended("failed"), "the action of quad ends (door@gate: failed)"),
        (ended("it jams"), "the action of quad ends (door@gate: failed, it jams)"),
        (lost(16), "door@gate cannot be resolved before tick 16, and is due at tick 15"),
        (lost(None), "door@gate can never be resolved, and is due at tick 15"),
    ],
)
def test_failures_name_their_reason_once(lines: list[records.Record], said: str) -> None:
    """And no lacking capability."""
    assert [line[11:] for line in told(*lines)] == [said]


@pytest.mark.parametrize("restarts", [True, False], ids=["a door", "a battery"])
def test_restarting_rounds_are_reported_once(restarts: bool) -> None:
    """Rounds are counted from the last resolution on, but a flat battery interrupts them only."""
    battery = "catalogue: {obstacles: {cell: {action: push, blocks: []}}}\nflat: cell\n"
    kind = "door" if restarts else "cell"
    text = ROOM.replace("door", kind) + battery
    first, second = (records.Goal(tick, "quad", 0, 7, 1) for tick in (4, 9))
    opened = records.Resolved(5, f"{kind}@9", "digit", 8, False, True)
    gone = records.Gone(6, f"{kind}@9", vocabulary.ChangeCause.WORLD)
    said = told(first, opened, opened, gone, second, text=text)
    done = "quad reaches 7 [1, 1], round 1 done"
    kept = [line[11:] for line in said if "round" in line]
    assert kept == ([done, "rounds restart", done] if restarts else [done])


@pytest.mark.parametrize(
    ("count", "cached", "verified", "told"),
    [
        (13, 2, True, "13 strategies (1 to 13 states, 2 from the cache, verified)"),
        (13, 13, True, "13 strategies (1 to 13 states, all from the cache, verified)"),
        (13, 0, False, None),
        (8, 0, True, None),
    ],
)
def test_many_strategies_share_one_sentence(
    count: int, cached: int, verified: bool, told: str | None
) -> None:
    why, won, own = vocabulary.Reason.INITIAL, Verdict.REALIZABLE, objective_of({"hold": 4})
    found = [
        records.Synthesis(0, "q", why, won, 0.1, k + 1, k < cached, verified, "ab" * 32, None, own)
        for k in range(count)
    ]
    assert syntheses_words(found) == told
