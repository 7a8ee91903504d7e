"""Moves on demand: what one costs, the synthesizer's answer and the check of it by its text.

    python benchmarks/moves.py [--moves 300]

CPU time of both processes; the mean, since a clock tick is longer than a move.
"""

import argparse
import os
import random
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from suites import corpus_folder

from safenav.errors import SynthesizerError
from safenav.runtime.mission import default_synthesizer, first_results
from safenav.scenario.reading.loader import load_scenario
from safenav.spec.compile import compile_task
from safenav.spec.parsing import read_specification
from safenav.spec.specification import Owner, Section, Specification
from safenav.synthesis.serving.served import ServedStrategy, serve
from safenav.synthesis.slugs import Synthesizer
from safenav.verify.moves import MoveCheck

SCENARIOS = Path(__file__).parents[1] / "scenarios"
CASES = (
    "case_study_1",
    "case_study_2",
    "case_study_3",
    "case_study_1_beliefs",
    "case_study_2_beliefs",
    "case_study_3_beliefs",
)
FINE = "safe-nav-locomotion/Belief_Evasion_fine_abstraction.structuredslugs"
BAR_CASE, BAR_FINE = 1.0, 20.0


def specifications() -> Iterator[tuple[str, Specification, float]]:
    """Name, specification and bar in milliseconds."""
    for name in CASES:
        scenario = load_scenario(SCENARIOS / f"{name}.yaml")
        for robot, answer in first_results(scenario, default_synthesizer(scenario)).items():
            yield f"{name}, {robot}", compile_task(answer.task, scenario.map), BAR_CASE
    corpus = corpus_folder()
    file = corpus / FINE if corpus is not None else None
    if file is not None and file.exists():
        yield "fine abstraction", read_specification(file.read_text(), file.name), BAR_FINE


def measure(spec: Specification, moves: int) -> tuple[float, int, float, float]:
    """Seconds (wall) until the first move, how many there were, and milliseconds (CPU) of an
    answer, both processes together, and of its check. The environment plays at random in the
    listed strategy, which the moves must be those of."""
    listed = Synthesizer(seconds=600).synthesize(spec).strategy
    assert listed is not None
    begun = time.perf_counter()
    options = ("--biasForAction",) if spec.section(Section.ENV_LIVENESS) else ()
    strategy = serve(spec, options=options, seconds=600)
    if not isinstance(strategy, ServedStrategy):
        raise SynthesizerError(f"{spec.robot}: {strategy}")
    ready, check, dice = time.perf_counter() - begun, MoveCheck(spec), random.Random(1)
    inputs = [variable.name for variable in spec.owned(Owner.INPUT)]
    answering = checking = 0.0
    made = 0
    with strategy:
        served = seconds_of(strategy.pid)
        node = listed.initial()[0]
        here = strategy.start(listed.values(node))
        assert here is not None
        while made < moves and listed.transitions[node]:
            node = dice.choice(listed.transitions[node])
            after = listed.values(node)
            given = {name: after[name] for name in inputs}
            asked = time.process_time()
            move = strategy.move(here, given)
            got = time.process_time()
            assert move is not None and move.to.values == after
            check.move(here, given, move)
            answering, checking = answering + got - asked, checking + time.process_time() - got
            here, made = move.to, made + 1
        answering += seconds_of(strategy.pid) - served
    return ready, made, 1000 * answering / made, 1000 * checking / made


def seconds_of(pid: int) -> float:
    """CPU seconds of a process so far (Linux)."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--moves", type=int, default=1000)
    moves = parser.parse_args().moves
    print("| specification | ready s | moves | answer ms | check ms | bar ms |")
    print("|---|---|---|---|---|---|")
    late = 0
    for name, spec, bar in specifications():
        ready, made, answer, check = measure(spec, moves)
        late += answer + check > bar
        print(f"| {name} | {ready:.2f} | {made} | {answer:.2f} | {check:.2f} | {bar:g} |")
    return 1 if late else 0


if __name__ == "__main__":
    sys.exit(main())
