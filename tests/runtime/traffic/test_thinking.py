"""Searches for joint plans while time passes: the mission receives events meanwhile."""

import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from msgspec.structs import replace
from safenav.runtime.termination import RunEnded, Stop
from safenav.runtime.traffic.background_search import BackgroundSearch, Unknown
from safenav.runtime.traffic.plan_search import PlanSearch

from runtime.played import Run, loaded
from runtime.worlds import Bare
from safenav.outcome import Outcome
from safenav.runtime.run.mission import Mission
from safenav.scenario.reading.loader import load_scenario
from safenav.scenario.settings import Clock
from safenav.spec.specification import Specification
from safenav.synthesis.slugs import Synthesizer
from safenav.trace import records

SCENARIO = Path(__file__).parents[3] / "scenarios" / "corridor_swap.yaml"


BESIDE = """
name: two in a corridor, a third one in the room beside it
map: {grid: ["#########", "#.......#", "#.#####.#", "#...#...#", "#...#...#", "#########"]}
catalogue: {robots: {cart: {mobility: free, layer: ground, capabilities: []}}}
robots:
  a: {model: cart, start: [1, 1], objective: {visit: [[1, 7], [1, 1]]}}
  b: {model: cart, start: [1, 7], objective: {visit: [[1, 1], [1, 7]]}}
  c: {model: cart, start: [4, 1], objective: {visit: [[4, 3], [4, 1]]}}
clock: live
"""


CROWDED = """
name: five on a narrow floor, who get new strategies after plans
map: {grid: ["###########", "#....#....#", "#.........#", "###########"]}
catalogue: {robots: {cart: {mobility: free, layer: ground, capabilities: []}}}
robots:
  a: {model: cart, start: [2, 1], objective: {visit: [[2, 8], [2, 1]]}}
  b: {model: cart, start: [2, 2], objective: {visit: [[2, 8], [2, 3], [1, 2]]}}
  c: {model: cart, start: [2, 6], objective: {cover: [[2, 6]]}}
  d: {model: cart, start: [2, 7], objective: {cover: [[2, 6], [2, 2]]}}
  e: {model: cart, start: [2, 3], objective: {ltl: {liveness: [region = 24]}}}
until: {rounds: 1}
clock: live
"""


class Wall(Bare):
    """A floor on the wall clock."""

    step, pause = 0.01, 0.0

    def __init__(self) -> None:
        super().__init__()
        self.begun = time.monotonic()

    def now(self) -> float:
        return time.monotonic() - self.begun

    def pass_until(self, due: float) -> None:
        time.sleep(max(0.0, due - self.now()))


def slow(patch: pytest.MonkeyPatch, over: threading.Event) -> list[str]:
    """Let searches go on until an event; the names of the threads that have searched."""
    searched, usual = list[str](), PlanSearch._searched

    def late(search: PlanSearch, *about: object) -> object:
        searched.append(threading.current_thread().name)
        while not over.wait(0.01):
            search.searches.check()
        return usual(search, *about)  # type: ignore[arg-type]

    patch.setattr(PlanSearch, "_searched", late)
    return searched


def mission() -> tuple[Mission, Run]:
    scenario, trace = replace(load_scenario(SCENARIO), clock=Clock.LIVE), Run()
    return Mission(scenario, world=Wall(), listeners=[trace]), trace


def test_events_of_the_world_are_taken_while_a_joint_plan_is_searched(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    over = threading.Event()
    searched = slow(monkeypatch, over)
    run, trace = mission()
    heard = 0
    run.start()
    while run.result is None:
        run.step()
        heard += run._traffic.wanted is not None
        if heard == 2:
            over.set()
    assert run.result.outcome is Outcome.COMPLETED
    assert searched and threading.main_thread().name not in searched
    assert not trace.findings


def test_robots_with_reversible_steps_move_while_a_joint_plan_is_searched(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The plan begins where they were: they go back, or it is shortened to a way from where they
    are."""
    over, trace, meanwhile = threading.Event(), Run(), list[str]()
    searched = slow(monkeypatch, over)
    run = Mission(loaded(BESIDE), world=Wall(), listeners=[trace])

    def note(record: records.Record) -> None:
        if isinstance(record, records.Depart) and run._traffic.wanted is not None:
            meanwhile.append(record.robot)
            if meanwhile.count("c") == 2:
                over.set()

    run.state.listeners = (*run.state.listeners, note)
    assert run.run().outcome is Outcome.COMPLETED
    assert searched and over.is_set()
    assert not trace.findings


def test_a_run_that_is_stopped_abandons_its_search(monkeypatch: pytest.MonkeyPatch) -> None:
    searched = slow(monkeypatch, threading.Event())
    run, _ = mission()
    run.start()
    while not searched:
        run.step()
    run.give_up()  # returns although the search has no end
    assert run.result is not None and run.result.outcome is Outcome.INTERRUPTED


def test_robots_off_their_strategies_get_strategies_that_are_found_later(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A strategy that was waited for is used, not forgotten and asked for again."""
    usual, asked = Synthesizer.synthesize_all, list[str]()

    def late(synthesizer: Synthesizer, specs: Sequence[Specification], **options: object) -> object:
        if threading.current_thread() is not threading.main_thread():
            asked.extend(spec.to_structuredslugs() for spec in specs)
            time.sleep(0.02)
        return usual(synthesizer, specs, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(Synthesizer, "synthesize_all", late)
    trace = Run()
    run = Mission(loaded(CROWDED), world=Wall(), listeners=[trace])
    run.start()
    while run.result is None and len(asked) < 100:
        run.step()
    assert run.result is not None and run.result.outcome is Outcome.COMPLETED
    assert asked and not trace.findings


def asked(thinking: BackgroundSearch, moment: object, search: Callable[[], object]) -> object:
    """The answer, asked for until it is there."""
    for _ in range(30_000):
        try:
            return thinking.ask(moment, search)  # type: ignore[arg-type]
        except Unknown:
            time.sleep(0.01)
    raise AssertionError("no answer")


def test_a_new_query_abandons_the_search_for_an_earlier_state() -> None:
    thinking, going = BackgroundSearch(Stop()), threading.Event()
    thinking.background = True

    def endless() -> str:
        going.set()
        while True:
            thinking.check()
            time.sleep(0.001)

    with pytest.raises(Unknown):
        thinking.ask("before", endless)
    assert going.wait(300)
    assert asked(thinking, "now", lambda: "found") == "found"
    assert asked(thinking, "now", lambda: "again") == "again"  # each answer is given once
    thinking.close()


def test_an_exception_of_a_search_is_raised_in_the_run() -> None:
    thinking = BackgroundSearch(Stop(asked="enough"))
    thinking.background = True
    with pytest.raises(RunEnded):
        asked(thinking, 1, thinking.check)
    thinking.close()


def test_without_a_thread_a_search_returns_its_result_immediately() -> None:
    assert BackgroundSearch(Stop()).ask(1, threading.get_ident) == threading.get_ident()
