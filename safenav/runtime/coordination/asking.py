"""Asking the synthesizer, for one robot or for several at once: is there a strategy for everybody?

Each robot climbs its ladder of specifications until one is realizable.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING
from weakref import WeakSet

from safenav.dataclass import dataclass
from safenav.errors import ResourceLimitError
from safenav.runtime.coordination.ladder import Errand, Ladder
from safenav.runtime.over import Stop
from safenav.runtime.team import TeamState
from safenav.scenario.objective import Objective, Word, describe
from safenav.spec.compile import compile_task
from safenav.spec.forms import Rung, Weakening, concession
from safenav.spec.task import Task
from safenav.synthesis.question import Listener as SynthesisListener
from safenav.synthesis.slugs import Synthesizer
from safenav.synthesis.verdict import SynthesisResult, Verdict
from safenav.trace import records, vocabulary

if TYPE_CHECKING:
    from safenav.synthesis.serving.served import ServedStrategy


@dataclass(frozen=True)
class Answer:
    """The synthesizer's last word on one robot's task. ``told``: the objective that it is for, and
    ``rung`` the form of it that stands in the task; ``tried``: what failed before."""

    task: Task
    result: SynthesisResult
    told: Objective
    rung: Rung
    tried: tuple[records.Tried, ...] = ()

    @property
    def realizable(self) -> bool:
        return self.result.verdict is Verdict.REALIZABLE

    @property
    def form(self) -> vocabulary.Form:
        """How the objective stands in the specification."""
        if self.rung.objective != self.told:
            return vocabulary.Form.ALTERNATION
        turned = self.rung.weakening is Weakening.TURNED
        return vocabulary.Form.OTHER_MEMORY if turned else vocabulary.Form.LITERAL

    def allows(self, word: Word) -> str | None:
        """How far its form falls short of the objective, and why; None if it does not."""
        others = [other.name for other in self.task.observed if other.danger]
        return concession(self.told, self.rung, word, others)

    def words(self, word: Word) -> str:
        """The objective in the form that was asked for, in the user's words."""
        allows = self.allows(word)
        return describe(self.told, word) + (f" ({allows})" if allows else "")


@dataclass(frozen=True)
class Attempt:
    """Answers for the robots that were asked about."""

    errands: Mapping[str, Errand]
    answers: Mapping[str, Answer]

    @property
    def failed(self) -> list[str]:
        """The robots that have no strategy."""
        return [name for name, answer in self.answers.items() if not answer.realizable]


class Asking:
    """Asks for strategies; counts what that cost (``syntheses``, ``seconds``). ``busy``: a
    synthesis is under way."""

    def __init__(
        self,
        state: TeamState,
        synthesizer: Synthesizer,
        stop: Stop,
        progress: SynthesisListener | None = None,
    ) -> None:
        self._ladder = Ladder(state)
        self._world = state.scenario.map
        self._synthesizer = synthesizer
        self._stop = stop
        self._progress = progress
        self._served: WeakSet[ServedStrategy] = WeakSet()
        self.busy = False
        self.syntheses = 0
        self.seconds = 0.0

    def attempt(self, errands: Mapping[str, Errand]) -> Attempt:
        """Ask for strategies for these robots. Raises ResourceLimitError if a synthesis runs out
        of time or memory, RunOver if the run is to end."""
        ladders = {name: self._ladder.candidates(name, errand) for name, errand in errands.items()}
        answers: dict[str, Answer] = {}
        while True:
            asked = {
                name: candidate
                for name, ladder in ladders.items()
                if not (name in answers and answers[name].realizable)
                and (candidate := next(ladder, None)) is not None
            }
            if not asked:
                return Attempt(errands, answers)
            results = self._ask([task for _, task in asked.values()])
            for (name, (rung, task)), result in zip(asked.items(), results, strict=True):
                before = answers.get(name)
                tried = before.tried if before is not None else ()
                if before is not None:
                    failed = before.result
                    verdict = vocabulary.RecordedVerdict(failed.verdict.value)
                    tried += (
                        records.Tried(
                            before.form, before.task.fairness.value, failed.spec_sha256, verdict
                        ),
                    )
                told = errands[name].objective
                answers[name] = Answer(task, result, told, rung, tried)

    def close(self) -> None:
        """End the processes that give moves on demand."""
        for served in tuple(self._served):
            served.close()

    def _ask(self, tasks: list[Task]) -> list[SynthesisResult]:
        self._stop.check()
        self.busy = True

        def hear(progress: object) -> None:
            self._stop.check()
            if self._progress is not None:
                self._progress(progress)  # type: ignore[arg-type]

        try:
            results = self._synthesizer.synthesize_all(
                [compile_task(task, self._world) for task in tasks], progress=hear
            )
        finally:
            self.busy = False
        for result in results:
            if result.served is not None:
                self._served.add(result.served)
            self.syntheses += 1
            self.seconds += 0.0 if result.cached else result.seconds
            if result.verdict not in (Verdict.REALIZABLE, Verdict.UNREALIZABLE):
                raise ResourceLimitError(
                    f"the synthesis for {result.robot} ended by {result.verdict.value} after "
                    f"{result.seconds:.1f} s; raise limits.synthesis_seconds or "
                    "limits.synthesis_memory in the scenario"
                )
        return results
