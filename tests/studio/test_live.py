"""A run as pages see it: the same for all, whole after a reload, changed while it runs."""

from __future__ import annotations

import asyncio
import json
import os
import signal
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from motion.runs import live_trace
from once import trace_of_shipped
from safenav.report.page.html import LiveRun, encoded
from safenav.run.checked import check_trace
from safenav.run.reading import run_of
from safenav.studio import live
from safenav.studio.live import StudioRun, WatchedRun
from safenav.studio.process import RunOrder
from safenav.trace.file import read_bytes
from safenav.trace.records import Resolved
from studio.serving import MINUTES, SCENARIOS, Page, Served, opened, visit

DOOR = SCENARIOS / "case_study_1.yaml"


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    with Served("run", DOOR, "--live") as found:
        visit(found.address, begin)  # whichever test comes first finds a run
        yield found


async def begin(page: Page) -> None:
    """Another run, paused after its first tick."""
    await page.say("speed", value=64)
    await page.say("restart")
    await page.state(phase="starting")
    await page.say("step")
    await page.tick(1)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"kind": "close", "type": "door", "region": 47}, "door@47 already exists there"),
        ({"kind": "objective", "robot": "digit", "objective": {"hold": 5000}}, "outside the map"),
    ],
)
def test_an_impossible_change_is_refused_with_the_reason(
    change: dict[str, Any], told: str, served: Served
) -> None:
    async def story(page: Page) -> None:
        whole = await page.hear(lambda m: m["is"] in ("run", "hello") and m["is"] == "run")
        if whole["state"]["phase"] != "paused":
            await begin(page)
        await page.say("change", **change)
        refused = await page.hear(lambda m: m["is"] == "refused")
        assert told in refused["message"]

    visit(served.address, story)


def test_two_pages_agree_and_a_reload_in_mid_run_loses_nothing(served: Served) -> None:
    async def main() -> None:
        async with opened(served.address) as page:
            await begin(page)
        async with opened(served.address) as one, opened(served.address) as other:
            first = await one.hear(lambda m: m["is"] == "run")
            assert first == await other.hear(lambda m: m["is"] == "run")
            await one.say("step")
            at = first["run"]["last"] + 1
            await one.tick(at)
            await other.tick(at)
            news = [m["news"] for m in one.heard if m["is"] == "news"]
            assert news == [m["news"] for m in other.heard if m["is"] == "news"]
        async with opened(served.address) as again:
            whole = await again.hear(lambda m: m["is"] == "run")
            assert whole["run"]["last"] == at
            assert len(whole["run"]["robots"][0]["path"]) == at + 1

    asyncio.run(main())


def test_a_run_that_is_ended_leaves_a_sound_trace_and_can_restart(served: Served) -> None:
    async def story(page: Page) -> None:
        await begin(page)
        await page.say("end")
        ended = await page.state(phase="ended")
        assert ended["state"]["outcome"] == "interrupted"
        assert check_trace(read_bytes(await page.get("save/trace"))).findings == ()
        await page.say("restart", seed=7)
        await page.state(phase="paused", seed=7)
        await page.tick(0)
        header = json.loads((await page.get("save/trace")).splitlines()[0])
        assert header["scenario"]["seed"] == 7

    visit(served.address, story)


def test_a_live_run_is_shown_in_seconds() -> None:
    async def story(page: Page) -> None:
        await page.say("speed", value=64)
        await page.say("restart", play=True)
        await page.hear(lambda m: m["is"] == "news" and m["news"]["times"][-1:] > [20.0])
        await page.say("end")
        ended = await page.state(phase="ended")
        times = ended["run"]["times"]
        assert times[0] == 0 and times == sorted(set(times))
        assert any(robot["steps"] for robot in ended["run"]["robots"])

    with Served("run", DOOR, "--live", "--clock", "live") as served:
        visit(served.address, story)


@pytest.mark.parametrize("name", ["case_study_3_beliefs", "team_of_six", "live"])
def test_the_messages_of_all_ticks_add_up_to_the_whole_run(name: str) -> None:
    """What a page that was there from the beginning has, and one that was opened later."""
    clocked = name == "live"
    data = live_trace("team_of_six") if clocked else trace_of_shipped(name).read_bytes()
    trace = read_bytes(data)
    live = LiveRun(trace.header, "run.jsonl")
    page = json.loads(json.dumps(live.whole()))
    tick = 0
    for record in (*trace.records, None):
        if record is None or record.tick != tick:
            tick = tick if record is None else record.tick
            _join(page, json.loads(json.dumps(live.news())))
        if record is not None:
            live.append(record)
    whole = encoded(run_of(trace), "run.jsonl")
    wholes = [json.loads(json.dumps(each)) for each in (live.whole(), whole)]
    assert [*map(_settled, wholes)] == [_settled(page)] * 2
    assert any(isinstance(record, Resolved) for record in trace.records)


def test_a_page_shows_the_last_tick_while_a_program_does_nothing() -> None:
    data = trace_of_shipped("team_of_six").read_bytes()
    told: list[dict[str, Any]] = []
    run = WatchedRun(RunOrder("", "run.jsonl"), told.append, trace=None)

    async def main() -> None:
        lines = data.splitlines(keepends=True)
        first = lines[
            : next(at for at, line in enumerate(lines) if json.loads(line).get("tick", 0) > 8)
        ]
        for line in first:
            run.hear(json.loads(line))
        told.append({"is": "silence"})
        whole = encoded(run_of(read_bytes(b"".join(first))), "run.jsonl")
        while told[-1]["is"] != "news":
            await asyncio.sleep(0.01)
        assert run.whole == whole

    asyncio.run(asyncio.wait_for(main(), 10))


def _join(page: dict[str, Any], news: dict[str, Any]) -> None:
    """As front/src/live/player.ts does."""
    since = news["since"]

    def renewed(old: list[Any], new: list[Any]) -> list[Any]:
        return [*(entry for entry in old if entry[0] < since), *new]

    for robot, more in zip(page["robots"], news["robots"], strict=True):
        for key in ("tasks", "progress", "charge", "sight"):
            if robot[key] is not None:
                robot[key] = renewed(robot[key], more[key])
        robot["steps"] = [*(s for s in robot["steps"] if s[1] < since - 1), *more["steps"]]
        robot["path"] = robot["path"][:since] + more["path"]
        if robot["headings"] is not None:
            robot["headings"] = robot["headings"][:since] + more["headings"]
        for of, told in more["beliefs"].items():
            robot["beliefs"][of] = renewed(robot["beliefs"].get(of, [[0, 0, -1]]), told)
    named = {obstacle["name"]: obstacle for obstacle in (*page["obstacles"], *news["obstacles"])}
    page |= {"obstacles": [*named.values()], "last": news["last"]}
    page |= {key: renewed(page[key], news[key]) for key in ("stack", "events")}
    page["times"] = page["times"] and page["times"][:since] + news["times"]
    page["sets"][news["known"] :] = news["sets"]


def _settled(run: dict[str, Any]) -> list[Any]:
    """What grows, with sets in full."""

    def placed(changes: list[list[Any]]) -> list[Any]:
        return [[*entry, -1 if at < 0 else run["sets"][at]] for *entry, at in changes]

    found = [run[key] for key in ("last", "times", "events", "stack", "obstacles")]
    for robot in run["robots"]:
        keys = ("path", "headings", "steps", "tasks", "progress", "charge")
        found += [robot[key] for key in keys]
        found += [placed(robot["sight"]), *map(placed, robot["beliefs"].values())]
    return found


Processes = list[asyncio.subprocess.Process]


@pytest.fixture
def processes(monkeypatch: pytest.MonkeyPatch) -> Processes:
    """The processes of the runs of a test."""
    found: Processes = []
    start = live.started

    async def started(module: str, order: RunOrder) -> asyncio.subprocess.Process:
        found.append(await start(module, order))
        return found[-1]

    monkeypatch.setattr(live, "started", started)
    return found


def test_pages_learn_that_a_long_tick_has_ended(processes: Processes) -> None:
    told: list[dict[str, Any]] = []

    async def story(run: StudioRun) -> None:
        os.kill(processes[0].pid, signal.SIGSTOP)
        run.step()
        await until(lambda: shown(told)["busy"])
        os.kill(processes[0].pid, signal.SIGCONT)
        await until(lambda: not shown(told)["busy"])
        assert shown(told)["phase"] == "paused"

    play(story, told)


def test_a_run_whose_process_is_killed_has_failed(processes: Processes) -> None:
    """It does not look like one that a user has ended; the ticks before it are kept."""
    told: list[dict[str, Any]] = []

    async def story(run: StudioRun) -> None:
        os.kill(processes[0].pid, signal.SIGKILL)
        await until(lambda: shown(told)["phase"] == "ended")
        assert "was killed (SIGKILL)" in shown(told)["failure"]
        assert run.whole is not None

    play(story, told)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
def test_a_full_disk_ends_the_run_and_is_named() -> None:
    told: list[dict[str, Any]] = []

    async def story() -> None:
        run = StudioRun(RunOrder(DOOR.read_text(), str(DOOR)), told.append, trace=Path("/dev/full"))
        await run.start()
        await until(lambda: shown(told)["phase"] == "ended")
        found = shown(told)["failure"]
        assert found == "cannot write the trace /dev/full: No space left on device"
        await run.end()  # as another run does first

    asyncio.run(story())


def play(story: Callable[[StudioRun], Awaitable[None]], told: list[dict[str, Any]]) -> None:
    """A run that has begun and waits, and what happens to it."""

    async def main() -> None:
        run = StudioRun(RunOrder(DOOR.read_text(), str(DOOR)), told.append, trace=None)
        await run.start()
        await until(lambda: run.state["phase"] == "paused")
        await story(run)
        await run.end()

    asyncio.run(main())


def shown(told: list[dict[str, Any]]) -> dict[str, Any]:
    """The state that a page shows."""
    states: list[dict[str, Any]] = [message["state"] for message in told if "state" in message]
    return states[-1]


async def until(condition: Any) -> None:
    async with asyncio.timeout(MINUTES):
        while not condition():
            await asyncio.sleep(0)
