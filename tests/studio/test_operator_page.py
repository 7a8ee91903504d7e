"""A run in the studio, and the user who helps it, orders work and sets inputs."""

from pathlib import Path

import pytest

from once import beside
from report.browser import Browser
from runtime.test_operator import GATE
from safenav.run.checked import check_trace
from safenav.trace.file import read_bytes
from safenav.trace.records import Appeared, Inputs, Operator, Resolved, Waiting
from studio.board import Board
from studio.serving import Page, Served, visit


@pytest.mark.slow
def test_the_page_can_help_a_run_that_waits(tmp_path: Path) -> None:
    scenario = tmp_path / "gate.yaml"
    scenario.write_text(GATE)

    async def story(page: Page) -> None:
        await page.say("speed", value=64)
        await page.say("play")
        await page.hear(
            lambda m: "waiting" in str(m.get("news", m.get("run", {}).get("events", "")))
        )
        await page.say("change", kind="permanent", obstacle="gate@99")
        refused = await page.hear(lambda m: m["is"] == "refused")
        assert "known: gate@27" in refused["message"]
        await page.say("change", kind="resolved", obstacle="gate@27")
        ended = await page.state(phase="ended")
        assert ended["state"]["outcome"] == "completed"
        trace = read_bytes(await page.get("save/trace"))
        assert check_trace(trace).findings == ()
        assert [r.outcome for r in trace.records if isinstance(r, Waiting)] == ["operator_needed"]
        assert [r.intervention for r in trace.records if isinstance(r, Operator)] == ["resolved"]

    with Served("run", scenario, "--live") as served:
        visit(served.address, story)


YARD = beside(__file__, "scenarios/yard.yaml")


async def begin(page: Page) -> None:
    await page.say("restart")
    await page.state(phase="paused")


def test_a_user_orders_work_and_sets_an_input(browser: Browser, tmp_path: Path) -> None:
    scenario = tmp_path / "yard.yaml"
    scenario.write_text(YARD)
    with Served("run", scenario, "--live") as served:
        visit(served.address, begin)
        board = Board(browser, served.address, cols=8)
        browser.one('[role="switch"][aria-label="alarm"]').click()
        browser.one('[aria-label="Next tick"]').click()
        browser.wait(lambda: browser.all('[role="switch"][aria-checked="true"]'))
        orders = [b.text for b in browser.all("button") if b.text.startswith("Order: ")]
        assert orders == ["Order: parcel"]  # no robot can swap a flat battery
        board.choose("Order: parcel")
        board.click(10)
        browser.one('[role="switch"][aria-label="alarm"]').click()
        board.fast()
        browser.one('[aria-label="Run"]').click()
        browser.wait(lambda: browser.one(".badge").text == "completed")
        trace = read_bytes(board.saved("trace"))
    assert check_trace(trace).findings == ()
    assert [r.values["alarm"] for r in trace.records if isinstance(r, Inputs)] == [True, False]
    assert [r.obstacle for r in trace.records if isinstance(r, Appeared)] == ["parcel@10"]
    assert [r.robot for r in trace.records if isinstance(r, Resolved)] == ["digit"]
