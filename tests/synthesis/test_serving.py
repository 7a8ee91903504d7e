"""A strategy on demand equals the explicit one."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from safenav.errors import SynthesizerError
from safenav.outcome import Verdict
from safenav.runtime.coordination.on_demand import OnDemand
from safenav.spec.specification import Specification
from safenav.synthesis.binary import Binary
from safenav.synthesis.cache import Cache
from safenav.synthesis.serving.served import (
    Position,
    ServedMove,
    ServedStrategy,
    falls,
    serve,
)
from safenav.synthesis.slugs import Synthesizer
from synthesis.requests import NATIVE, Script, gone, impossible


@pytest.fixture
def served(patrol: Specification, slugs: Binary) -> ServedStrategy:
    strategy = serve(patrol, slugs)
    assert isinstance(strategy, ServedStrategy)
    return strategy


def test_following_the_moves_visits_the_listed_strategy(
    patrol: Specification, slugs: Binary, served: ServedStrategy
) -> None:
    """Every edge, and the measure keeps its promise on each."""
    listed = Synthesizer(slugs, cache=Cache.off()).synthesize(patrol).strategy
    assert listed is not None
    with served:
        for number in listed.initial():
            assert served.start(listed.values(number)) is not None
        measures: dict[int, Position] = {}
        for node, rank in enumerate(listed.ranks):
            here = measures.get(node, Position(listed.values(node), rank, 10**9, None))
            for successor in listed.transitions[node]:
                after = listed.values(successor)
                move = served.move(here, {"request": after["request"]})
                assert move is not None
                assert (dict(move.to.values), move.to.goal) == (after, listed.ranks[successor])
                measures[successor] = move.to
                assert falls(here, move, assumption_holds=False)


def test_a_position_is_that_of_the_first_matching_node(
    patrol: Specification, slugs: Binary, served: ServedStrategy
) -> None:
    """By all values and by the region alone; OnDemand finds what a listed strategy finds."""
    listed = Synthesizer(slugs, cache=Cache.off()).synthesize(patrol).strategy
    assert listed is not None
    with served:
        count = len(listed.states)
        planned = OnDemand(served, count)
        for values in map(listed.values, range(count)):
            for wanted in (values, {"region": values["region"]}):
                first = listed.find(wanted)
                assert first is not None
                found = served.find(wanted, count)
                assert found is not None
                assert (dict(found.values), found.goal) == (
                    listed.values(first),
                    listed.ranks[first],
                )
                number = planned.find(wanted)
                assert number is not None
                assert planned.values(number) == listed.values(first)
        assert served.find({"region": 9}, count) is None
        assert served.find({}, 0) is None


def test_moves_outside_the_strategy_are_refused(served: ServedStrategy) -> None:
    with served:
        assert served.start({"region": 4}) is None
        assert served.start({"region": 9}) is None
        here = served.start({})
        assert here is not None
        with pytest.raises(KeyError, match="request"):
            served.move(here, {})
    with pytest.raises(SynthesizerError, match="has been closed"):
        served.start({})


def test_an_unrealizable_robot_has_no_moves(patrol: Specification, slugs: Binary) -> None:
    assert serve(impossible(patrol), slugs) is Verdict.UNREALIZABLE


def test_a_synthesizer_that_dies_in_mid_run_is_an_error(served: ServedStrategy) -> None:
    with served:
        assert served.start({}) is not None
        os.kill(served.pid, signal.SIGKILL)
        with pytest.raises(SynthesizerError, match="ended while it served a strategy"):
            served.start({})
    assert gone(served.pid)


def test_the_process_ends_with_its_owner(
    patrol: Specification, slugs: Binary, tmp_path: Path
) -> None:
    """An owner that is killed cannot close anything: the end of its input ends the program."""
    (tmp_path / "patrol").write_text(patrol.to_structuredslugs())
    program = (
        "import sys, time\n"
        "from pathlib import Path\n"
        "from safenav.spec.parsing import read_specification\n"
        "from safenav.synthesis.serving.served import serve\n"
        "from safenav.synthesis.binary import Binary\n"
        "spec = read_specification(Path(sys.argv[1]).read_text(), 'patrol')\n"
        "strategy = serve(spec, Binary(Path(sys.argv[2])))\n"
        "print(strategy.pid, flush=True)\n"
        "time.sleep(600)\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", program, tmp_path / "patrol", slugs.path],
        stdout=subprocess.PIPE,
        text=True,
    ) as owner:
        assert owner.stdout is not None
        pid = int(owner.stdout.readline())
        owner.kill()
    assert gone(pid)


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        ("echo nonsense; read request", "invalid reply"),
        ("echo '{\"protocol\": 2}'; read request", "invalid reply"),
        ("exit 7", "printed no verdict"),
    ],
)
def test_a_foreign_answer_is_an_error(
    patrol: Specification, script: Callable[[str], Binary], answer: str, message: str
) -> None:
    with pytest.raises(SynthesizerError, match=message):
        serve(patrol, script(NATIVE + answer))


def test_solving_that_takes_too_long_is_a_timeout(patrol: Specification, script: Script) -> None:
    begun = time.monotonic()
    assert serve(patrol, script(NATIVE + "exec sleep 600"), seconds=0.1) is Verdict.TIMEOUT
    assert time.monotonic() - begun < 300


@pytest.mark.parametrize(
    ("met", "distance", "assumption", "holds", "kept"),
    [
        (0, 4, 1, True, True),
        (0, 5, 1, False, True),
        (0, 5, 1, True, False),
        (0, 5, 0, False, False),
        (0, 6, 1, False, False),
        (1, 9, None, True, True),
    ],
)
def test_what_the_measure_promises(
    met: int, distance: int, assumption: int | None, holds: bool, kept: bool
) -> None:
    before = Position({}, 0, 5, 1)
    move = ServedMove(Position({}, 0, distance, assumption), met)
    assert falls(before, move, holds) is kept
