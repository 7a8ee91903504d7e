"""Random sequences of edits, runs and changes: no exception in page or server, sound traces."""

import asyncio
import os
import random
from collections.abc import Iterator
from typing import Any

import pytest

from report.browser import Browser
from safenav.run.checked import check_trace
from safenav.trace.file import read_bytes
from studio.serving import SCENARIOS, Page, Served, opened
from studio.test_editing import something

SEQUENCES = int(os.environ.get("SAFENAV_FUZZ", "0")) // 25 or 3
FIRST = int(os.environ.get("SAFENAV_FUZZ_FIRST", "0"))
LENGTH = 25
DOOR = (SCENARIOS / "case_study_1.yaml").read_text().split("expect:")[0]


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    file = tmp_path_factory.mktemp("random") / "mine.yaml"
    file.write_text(DOOR)
    with Served("studio", file, "--no-browser") as found:
        yield found


def message(chance: random.Random) -> dict[str, Any]:
    """Something that a page may say, sensible or not."""
    region, other = chance.randrange(-2, 100), chance.randrange(91)
    robot = chance.choice(("quad", "digit", "digit_2", "nobody", ""))
    obstacle = chance.choice(("door@47", f"door@{other}", "uncertainty@44", "x"))
    changes: list[dict[str, Any]] = [
        {"kind": "close", "type": "door", "region": region},
        {"kind": "close", "type": "uncertainty", "region": other, "truth": chance.random() < 0.5},
        {"kind": "open", "obstacle": obstacle},
        {"kind": "truth", "obstacle": obstacle, "traversable": chance.random() < 0.5},
        {"kind": "objective", "robot": robot, "objective": {"visit": [region, other]}},
        {"kind": "objective", "robot": robot, "objective": chance.choice(({}, [], {"hold": 17}))},
        {"kind": "service", "robot": robot, "active": chance.random() < 0.5},
        {"kind": ["strange"], "robot": {}},
    ]
    return chance.choice(
        [
            *({"do": "edit", **something(DOOR, chance)} for _ in range(2)),
            {"do": "edit", "op": chance.choice((None, "paint")), "regions": "all", "wall": 3},
            *({"do": "change", **change} for change in chance.sample(changes, 4)),
            {"do": "step"},
            {"do": "step"},
            {"do": "play"},
            {"do": "pause"},
            {"do": "speed", "value": chance.choice((64, 8, 0, "x"))},
            {"do": "text", "text": chance.choice(("", "a: [", "safenav: 1", "- x"))},
            {"do": "text", "text": DOOR},
            {"do": "restart", "seed": chance.choice((None, 3, -1, "x"))},
        ]
    )


def test_random_sessions_raise_no_error_in_page_or_server(browser: Browser, served: Served) -> None:
    """One page in a browser looks on, another one says whatever comes."""
    browser.visit(served.address)

    async def main() -> None:
        for seed in range(FIRST, FIRST + SEQUENCES):
            print("sequence", seed, flush=True)
            async with opened(served.address) as page:
                await _session(page, random.Random(seed))

    asyncio.run(main())
    assert browser.errors() == []
    browser.driver.refresh()
    browser.wait(lambda: browser.all("header h1"))
    assert browser.errors() == []


async def _session(page: Page, chance: random.Random) -> None:
    for _ in range(LENGTH):
        await page.say(**_renamed(message(chance)))
        if chance.random() < 0.3:
            await asyncio.sleep(0.05)
    await page.say("end")
    marker = f"# {chance.random()}"
    await page.say("text", text=marker)  # an answer to this is the last one
    mark = page.heard
    told = await page.hear(lambda m: m["is"] == "document" and m["text"] == marker)
    assert told["problems"]
    states = [m["state"] for m in mark if m.get("state")]
    assert all(state["failure"] is None for state in states), states
    if _something_to_save(mark):
        trace = read_bytes(await page.get("save/trace"))
        assert check_trace(trace).findings == ()


def _something_to_save(heard: list[dict[str, Any]]) -> bool:
    """Whether the newest run came to its first line before it was ended."""
    found, phase = False, None
    for message in heard:
        before, phase = phase, (message.get("state") or {}).get("phase", phase)
        if message["is"] in ("run", "news"):
            found = message.get("run", message.get("news")) is not None
        elif phase == "starting" and before != "starting":  # another one begins
            found = False
    return found


def _renamed(data: dict[str, Any]) -> dict[str, Any]:
    return {"does" if key == "do" else key: value for key, value in data.items()}
