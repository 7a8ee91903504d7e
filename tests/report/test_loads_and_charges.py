"""Replays follow the loads that robots carry and the charge of their batteries; pages show both."""

import json
import re
from pathlib import Path

import pytest

from once import SCENARIOS, beside
from report.browser import Browser
from safenav.cli import group
from safenav.motion.making import motion_of
from safenav.motion.timing import in_time
from safenav.report.page.html import page_of
from safenav.report.page.motion import page3d_of
from safenav.run.reading import read_run, run_of
from safenav.run.run import Run
from safenav.trace import records
from safenav.trace.file import read_trace

CART = beside(__file__, "scenarios/cart.yaml")


@pytest.fixture(scope="module")
def warehouse(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return _run(SCENARIOS / "warehouse_orders.yaml", tmp_path_factory.mktemp("loads"))


@pytest.fixture(scope="module")
def replay(warehouse: Path) -> Run:
    return read_run(warehouse)


def test_the_page_shows_loads_charges_and_requirements(
    browser: Browser, replay: Run, tmp_path: Path
) -> None:
    page = tmp_path / "page.html"
    page.write_text(page_of(replay, "x.jsonl"), encoding="utf-8")
    (taken,) = (tick for tick in range(replay.last) if _takes(replay, "pallet@71", tick))
    for tick, shown in ((taken - 1, "hidden"), (taken, "visible")):
        browser.open(page, f"#tick={tick}")
        sign = browser.one('[data-robot="carrier"] .load')
        assert sign.get_attribute("visibility") == shown
        assert ("carries pallet@shelf" in browser.one(".robots").text) == (shown == "visible")
        assert bool(browser.all('[data-obstacle="pallet@71"] rect[fill="none"]')) == (
            shown == "visible"
        )
    trace = read_trace(_cart(tmp_path))
    page.write_text(page_of(run_of(trace), "x.jsonl"), encoding="utf-8")
    browser.open(page, "#tick=8")  # 15 of 20, 4 more in a tick at home, 7 steps
    assert browser.one(".robots .charge").text.strip() == "60 %"

    night = _run(SCENARIOS / "hospital.yaml", tmp_path)
    group.main(["replay", str(night), "-o", str(page)], standalone_mode=False)
    browser.open(page)
    browser.wait(lambda: browser.all(".curves li[data-requirement]"))
    (curve,) = browser.all(".curves li[data-requirement]")
    assert curve.text == "apart: satisfied"
    drawn = str(browser.one(".curves .curve").get_attribute("d"))
    ticks = [float(point.split()[0]) for point in drawn.removeprefix("M").split("L")]
    last = json.loads(night.read_text().splitlines()[-1])["ticks"]
    assert ticks == sorted(ticks)  # the flat page counts a run in lockstep in ticks
    assert 0 <= ticks[0] < ticks[-1] <= last
    assert browser.errors() == []


def test_in_3d_an_order_appears_with_its_request(warehouse: Path) -> None:
    """It appeared at the start if no robot had been in its region."""
    trace = read_trace(warehouse)
    lines = in_time(trace, motion_of(trace)).records
    ordered = {one.obstacle: one.t for one in lines if isinstance(one, records.Appeared)}
    asked = [one for one in lines if isinstance(one, records.Request) and one.obstacle in ordered]
    first = {one.obstacle: one.t for one in reversed(asked)}
    assert first == ordered and all(ordered.values())


def test_in_3d_a_run_in_lockstep_has_the_charges_of_its_ticks(tmp_path: Path) -> None:
    trace = read_trace(_cart(tmp_path))
    page = page3d_of(trace, "run.jsonl", motion_of(trace))
    (data,) = re.findall(r'id="run">(.*?)</script>', page)
    run = json.loads(data)
    charge = [level for _, level in run["robots"][0]["charge"]]
    ticked = run_of(trace).track("cart").charge
    assert ticked is not None
    # Charging takes no time in such a motion: of what happens in one instant, the last is shown.
    assert charge[-1] == ticked.now > 0
    assert set(charge) <= {level for _, level in ticked}


def _takes(replay: Run, load: str, tick: int) -> bool:
    carriers = replay.hidden[load].loads
    return carriers.at(tick) != () and carriers.at(tick - 1) == ()


def _cart(folder: Path) -> Path:
    scenario = folder / "cart.yaml"
    scenario.write_text(CART, encoding="utf-8")
    return _run(scenario, folder)


def _run(scenario: Path, folder: Path, *options: str) -> Path:
    trace = folder / "run.jsonl"
    arguments = ["run", str(scenario), "--trace", str(trace), "--no-map", *options]
    group.main(arguments, standalone_mode=False)
    return trace
