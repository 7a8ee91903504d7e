"""The search for strategies: each robot tries its candidates until one is realizable, all
robots simultaneously."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from msgspec import Struct, field
from msgspec.structs import replace

from safenav.errors import ResourceLimitError
from safenav.outcome import Verdict
from safenav.runtime.coordination.task_candidates import Candidate, alone
from safenav.runtime.termination import Stop
from safenav.scenario.objective import Objective, Word
from safenav.scenario.objective_text import describe
from safenav.spec.compile import compile_task
from safenav.spec.forms import ObjectiveForm, Weakening, concession
from safenav.spec.specification import Specification
from safenav.spec.task import Task
from safenav.synthesis.request import Listener, SynthesisProgress, SynthesisResult
from safenav.synthesis.slugs import Synthesizer
from safenav.trace import records, vocabulary
from safenav.trace.words import seconds_words
from safenav.world.map import RegionMap

if TYPE_CHECKING:
    from concurrent.futures import Future, ThreadPoolExecutor


class TaskResult(Struct, frozen=True):
    """The last synthesis result for a robot's task. ``asked``: its objective, and ``chosen_form``
    the form of it in the task; ``tried``: the candidates that failed before."""

    task: Task
    result: SynthesisResult
    asked: Objective
    chosen_form: ObjectiveForm
    tried: tuple[records.Tried, ...] = ()

    @property
    def realizable(self) -> bool:
        return self.result.verdict is Verdict.REALIZABLE

    @property
    def form(self) -> vocabulary.Form:
        """The form of the objective in the specification."""
        if self.chosen_form.objective != self.asked:
            return vocabulary.Form.ALTERNATION
        turned = self.chosen_form.weakening is Weakening.TURNED
        return vocabulary.Form.OTHER_MEMORY if turned else vocabulary.Form.LITERAL

    def allows(self, word: Word) -> str | None:
        """The shortfall of its form from the objective, with the reason; None if there is none."""
        others = [other.name for other in self.task.observed if other.danger]
        return concession(self.asked, self.chosen_form, word, others)

    def words(self, word: Word) -> str:
        """The objective in the requested form, in the user's words."""
        allows = self.allows(word)
        return describe(self.asked, word) + (f" ({allows})" if allows else "")


def failed(results: Mapping[str, TaskResult]) -> list[str]:
    """The robots that have no strategy."""
    return [name for name, result in results.items() if not result.realizable]


class NotYet(Exception):  # noqa: N818 - it is not an error
    """A strategy is still being synthesized: request it again later."""


class Obsolete(Exception):  # noqa: N818 - it is not an error
    """No decision waits for this synthesis: it is abandoned."""


class BackgroundRequest(Struct, eq=False):
    """Syntheses that run while the robots move. ``obsolete``: no decision waits for them."""

    future: Future[list[SynthesisResult]] | None = None
    obsolete: bool = False

    @property
    def done(self) -> bool:
        return self.future is not None and self.future.done()


class StrategySearch(Struct, eq=False):
    """Requests syntheses, and counts their cost (``syntheses``, ``seconds``). ``busy``: one is
    running. ``background``: whether they run while the robots move; requests then raise NotYet
    until the result is available. ``wanted``: the texts that decisions have requested since they
    were last made again."""

    _world: RegionMap
    _synthesizer: Synthesizer
    _stop: Stop
    _progress: Listener | None = None
    busy: bool = False
    background: bool = False
    syntheses: int = 0
    seconds: float = 0.0
    _pool: ThreadPoolExecutor | None = None
    _asked: dict[str, tuple[BackgroundRequest, int]] = field(default_factory=dict)
    _awaited: bool = False
    wanted: set[str] = field(default_factory=set)

    def fresh(self) -> bool:
        """Whether all pending results have arrived since the last call."""
        # read once: a synthesis may end at any moment
        pending = any(not request.done for request, _ in self._asked.values())
        come, self._awaited = self._awaited and not pending, pending
        return come

    def forget(self) -> None:
        """Forget the results that decisions waited for."""
        self.wanted.clear()
        self.abandon()
        self._asked.clear()

    def abandon(self) -> None:
        """Abandon the running syntheses that are not ``wanted``."""
        wanted = {id(self._asked[text][0]) for text in self.wanted & self._asked.keys()}
        for text, (request, _) in [*self._asked.items()]:
            if not request.done and id(request) not in wanted:
                request.obsolete = True
                del self._asked[text]

    def synthesize(self, candidates: Mapping[str, Sequence[Candidate]]) -> dict[str, TaskResult]:
        """The result for each robot: of its first realizable candidate, or of the last one; or of
        the task without other robots if even that is unrealizable. Raises ResourceLimitError if a
        synthesis runs out of time or memory, RunEnded if the run is to end."""
        found: dict[str, TaskResult] = {}
        left = {name: [*each] for name, each in candidates.items()}
        while tried := {name: each.pop(0) for name, each in left.items() if each}:
            answers = self._answers(tried, found)
            doubtful = {
                name: replace(candidate, task=task)
                for name, candidate in tried.items()
                if answers[name].realizable and (task := alone(candidate.task)) is not None
            }
            refuted = self._answers(doubtful, found) if doubtful else {}
            refuted = {name: each for name, each in refuted.items() if not each.realizable}
            found |= answers | refuted
            for name in tried:
                if found[name].realizable:
                    left[name] = []
                elif name in refuted:  # with any assumption about others
                    form = found[name].chosen_form
                    left[name] = [each for each in left[name] if each.form != form]
        return found

    def _answers(
        self, candidates: Mapping[str, Candidate], before: Mapping[str, TaskResult]
    ) -> dict[str, TaskResult]:
        """The result of one candidate for each robot, after those ``before``."""
        results = self._request([each.task for each in candidates.values()])
        found = {}
        for (name, each), result in zip(candidates.items(), results, strict=True):
            tried = _tried(before[name]) if name in before else ()
            found[name] = TaskResult(each.task, result, each.asked, each.form, tried)
        return found

    def close(self) -> None:
        """End the syntheses in the background."""
        self.forget()
        if self._pool is not None:
            self._pool.shutdown(wait=False, cancel_futures=True)

    def _request(self, tasks: list[Task]) -> list[SynthesisResult]:
        self._stop.check()
        self.busy = True

        def hear(progress: SynthesisProgress) -> None:
            self._stop.check()
            if self._progress is not None:
                self._progress(progress)

        specs = [compile_task(task, self._world) for task in tasks]
        try:
            if self.background:
                results = self._in_background(specs)
            else:
                results = self._synthesizer.synthesize_all(specs, progress=hear)
        finally:
            self.busy = False
        for result in results:
            self.syntheses += 1
            self.seconds += 0.0 if result.cached else result.seconds
            if result.verdict not in (Verdict.REALIZABLE, Verdict.UNREALIZABLE):
                raise ResourceLimitError(
                    f"the synthesis for {result.robot} ended by {result.verdict.value} after "
                    f"{seconds_words(result.seconds)}; raise {_limit(result.verdict)} in the "
                    "scenario"
                )
        return results

    def _in_background(self, specs: Sequence[Specification]) -> list[SynthesisResult]:
        """Return the results. Raises NotYet unless all are available."""
        texts = [spec.to_structuredslugs() for spec in specs]
        new = {t: s for t, s in zip(texts, specs, strict=True) if t not in self._asked}
        if new:
            from concurrent.futures import ThreadPoolExecutor  # only live runs need it

            self._pool = self._pool or ThreadPoolExecutor(1)
            request = BackgroundRequest()
            request.future = self._pool.submit(self._synthesized, request, [*new.values()])
            self._asked |= {text: (request, index) for index, text in enumerate(new)}
        self.wanted.update(texts)
        if not all(self._asked[text][0].done for text in texts):
            self._awaited = True
            raise NotYet
        found = (self._asked[text] for text in texts)
        return [each.result()[index] for request, index in found if (each := request.future)]

    def _synthesized(
        self, request: BackgroundRequest, specs: Sequence[Specification]
    ) -> list[SynthesisResult]:
        """The results of a request, in a thread. Raises RunEnded, or Obsolete."""

        def hear(_: SynthesisProgress) -> None:
            self._stop.check()
            if request.obsolete:
                raise Obsolete

        return self._synthesizer.synthesize_all(specs, progress=hear)


def _tried(result: TaskResult) -> tuple[records.Tried, ...]:
    """Return the attempts that have failed so far."""
    verdict = result.result.verdict
    fairness, spec = result.task.fairness.value, result.result.spec_sha256
    return (*result.tried, records.Tried(result.form, fairness, spec, verdict))


def _limit(verdict: Verdict) -> str:
    """The limit that a synthesis has exhausted."""
    memory = verdict is Verdict.OUT_OF_MEMORY
    return "limits.synthesis_memory" if memory else "limits.synthesis_seconds"
