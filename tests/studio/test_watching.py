"""The live view of a mission that a program drives, in a world of its own."""

import json

import pytest

from report.browser import Browser
from runtime.worlds import Driven
from safenav import LiveView, Mission, load_scenario
from safenav.errors import UsageError
from studio.serving import SCENARIOS


def test_a_mission_in_a_world_of_ones_own_is_seen_as_it_happens(browser: Browser) -> None:
    scenario = load_scenario(SCENARIOS / "case_study_1.yaml")
    fleet = Driven(scenario)
    with LiveView(scenario, browser=False) as view:
        mission = Mission(scenario, world=fleet, listeners=[view])
        mission.start()
        browser.visit(view.address)
        for _ in range(9):
            mission.step()
        browser.wait(lambda: browser.tick >= 8)
        assert fleet.moves
        assert not browser.all('button[aria-label="Run"], button[aria-label="Pause the run"]')
        browser.press(" ")
        browser.wait(lambda: "drives the run" in browser.one("body").text)
        while mission.result is None:
            mission.step()
        assert mission.result.outcome == "completed"
        browser.wait(lambda: "completed" in browser.one("header").text)
        ticks = mission.result.ticks
        browser.wait(lambda: browser.tick == ticks)
        browser.visit(view.address)  # a page that comes late gets the whole run
        browser.wait(lambda: "completed" in browser.one("header").text)
        browser.wait(lambda: browser.tick == ticks)
        browser.press("\ue011")  # Home: back to the first tick
        browser.wait(lambda: browser.tick == 0)
        trace = browser.run(
            "const ask = new XMLHttpRequest(); ask.open('GET', 'save/trace', false); ask.send();"
            "return ask.responseText"
        )
        lines = [json.loads(line) for line in trace.splitlines()]
        assert lines[0]["type"] == "header" and lines[-1]["type"] == "outcome"
        browser.leave()
        view.wait()


def test_a_port_in_use_is_refused() -> None:
    scenario = load_scenario(SCENARIOS / "case_study_1.yaml")
    with LiveView(scenario, browser=False) as view:
        port = int(view.address.split(":")[2].split("/")[0])
        with pytest.raises(UsageError), LiveView(scenario, port=port, browser=False):
            pass
