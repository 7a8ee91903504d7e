"""The results of syntheses and of searches for joint plans, cached by their inputs (questions).

While a clock runs, threads compute them. A question without a result raises Pending and is repeated
in the next pass. A question that is not repeated is abandoned.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar, cast

from msgspec import Struct
from msgspec.structs import replace

from safenav.errors import ResourceLimitError, Verdict
from safenav.plan.ask import Deadlock, Found, Unserved, ask, ask_charged
from safenav.plan.order import acting_first, charges_now
from safenav.spec.specification import Specification
from safenav.synthesis.slugs import Listener, SynthesisProgress, SynthesisResult, Synthesizer
from safenav.team.apply import orders_ahead
from safenav.team.floor import Floor, Joint
from safenav.team.state import State
from safenav.trace.words import seconds_words

if TYPE_CHECKING:
    from concurrent.futures import Future, ThreadPoolExecutor

Answer = TypeVar("Answer")
FEW = 4
"""Maximum number of robots for which a search without charges comes first."""

Check = Callable[[], None]
"""A function that raises an exception if a search must end."""
Search = Callable[[Check], Found | Deadlock | Unserved | None]


class Pending(Exception):  # noqa: N818 - it is not an error
    """Signal that a result is not available yet. ``robots``: robots that wait for a strategy."""

    def __init__(self, robots: frozenset[int] = frozenset()) -> None:
        self.robots = robots
        super().__init__()


class Obsolete(Exception):  # noqa: N818 - it is not an error
    """Signal that a question has been abandoned, so that its search must end."""


class Question(Struct, eq=False):
    """A question without a result. ``asked``: whether it was repeated since the last ``forget``."""

    future: Future[Any] | None = None
    asked: bool = True
    obsolete: bool = False


class Answers:
    """The results so far. ``check`` raises if the run must end; ``busy``: whether the run's thread
    computes a result, which an exception may abort; ``background``: whether threads compute them;
    ``count``, ``seconds``: the cost of the syntheses; ``examined``: the number of resolved
    obstacles at the last search for a plan. ``stage``: the mission's stage at the last question for
    a plan with charges; ``vain``: the stage at the last such question without a plan; ``went``: the
    stage at which each robot with work was last sent to a charger."""

    def __init__(
        self,
        synthesizer: Synthesizer,
        check: Check = lambda: None,
        progress: Listener | None = None,
    ) -> None:
        self._synthesizer, self._check, self._progress = synthesizer, check, progress
        self._known: dict[str, SynthesisResult] = {}
        self._questions: dict[Hashable, Question] = {}
        self._pool: ThreadPoolExecutor | None = None
        self._awaited = self.background = self.busy = False
        self._recent: dict[Hashable, Any] = {}
        self.vain: Hashable = None
        self._fruitless = dict[Hashable, tuple[int, int]]()
        self.stage: Hashable = None
        self.examined = 0
        self.went = dict[int, Hashable]()
        self.count, self.seconds = 0, 0.0

    def strategies(self, specs: Sequence[Specification]) -> list[SynthesisResult | None]:
        """Return the synthesis result of each specification; None while it is under way. Raises
        ResourceLimitError if a synthesis has exhausted its limits."""
        texts = [spec.to_structuredslugs() for spec in specs]
        new = {t: s for t, s in zip(texts, specs, strict=True) if t not in self._known}
        parts = [{text: new[text]} for text in new] if self.background else [new] if new else []
        for part in parts:
            with suppress(Pending):
                results = self._ask(tuple(part), partial(self._synthesized, [*part.values()]))
                for text, result in zip(part, results, strict=True):
                    self.seconds += 0.0 if result.cached else result.seconds
                    _refuse_limit(result)
                    self._known[text] = result
        found = [self._known.get(text) for text in texts]
        self.count += len(found) - found.count(None)
        return found

    def plan(
        self,
        floor: Floor,
        joint: Joint,
        served: tuple[int, ...],
        state: State,
        *,
        better: bool = False,
    ) -> Found | Deadlock | Unserved | None:
        """Return a joint plan for the remaining mission, or the proof that there is none (None:
        unknown). ``state``: the team's state, with charges; ``better``: return only a plan for
        which the charges suffice."""
        found = self._plan(floor, joint, served, state, better=better)
        if not isinstance(found, Found):
            return found
        return replace(found, plan=acting_first(floor, joint, state, found.plan))

    def _plan(
        self, floor: Floor, joint: Joint, served: tuple[int, ...], state: State, *, better: bool
    ) -> Found | Deadlock | Unserved | None:
        about = floor.gates, floor.floors, floor.robots, floor.rounds, floor.barred, floor.inside
        more = floor.helping, floor.laden, floor.away, floor.resting
        key = floor.team, *about, *more, joint, served, len(state.over)
        asked, charges = (floor, joint, served, len(state.over)), charges_now(floor.team, state)
        if not charges:
            return self._plain(key, asked)
        further = orders_ahead(floor.team, state)
        charged: Search = partial(ask_charged, *asked, charges, state.time, further)
        found = None
        if not better and len(floor.robots) <= FEW:
            found = self._plain(key, asked)
            if isinstance(found, Deadlock | Unserved):
                return found  # the proof for any charges is quick
        counts = tuple(floor.is_done(i, count) or count for i, count in enumerate(joint.counts))
        self.stage = counts, joint.stages, served, len(state.over)
        # In a world with its own clock, charges change during the search, so its key omits them.
        # The plan is used once; the next search begins with the charges of its time.
        about_charges = () if self.background else (charges, state.time)
        with_charges = *key, "charges", *about_charges
        if self.stage != self.vain and (lasting := self._ask(with_charges, charged)) is not None:
            self._questions.pop(with_charges, None)
            return lasting
        self.vain = self.stage
        return found if better or found else self._plain(key, asked)

    def _plain(
        self, key: Hashable, asked: tuple[Floor, Joint, tuple[int, ...], int]
    ) -> Found | Deadlock | Unserved | None:
        """Return a joint plan for any charges. Each fruitless search from the same poses and
        obstacles leaves a sixteenth of its work to the next one."""
        floor, joint, served, _ = asked
        where = floor.gates, floor.rounds, joint.poses, joint.stages, served
        last, times = self._fruitless.get(where, (0, 0))
        answer = self._ask(key, partial(ask, *asked, fruitless=times))
        if answer is None and last != hash(key):
            self._fruitless[where] = hash(key), times + 1
        return answer

    @property
    def ready(self) -> bool:
        """Whether every question has a result."""
        return all(each.future is None or each.future.done() for each in self._questions.values())

    def fresh(self) -> bool:
        """Return whether results have arrived since the last call and no question is open."""
        ready = self.ready  # read once: a result may arrive at any moment
        come, self._awaited = self._awaited and ready, not ready
        return come

    def keep(self) -> None:
        """Keep all open questions as if each had been repeated."""
        for each in self._questions.values():
            each.asked = True

    def forget(self) -> None:
        """Abandon the questions that were not repeated since the last call."""
        for key, each in [*self._questions.items()]:
            if not each.asked:
                each.obsolete = True
                del self._questions[key]
            each.asked = False

    def close(self) -> None:
        """End the threads."""
        for each in self._questions.values():
            each.obsolete = True
        if self._pool is not None:
            self._pool.shutdown(wait=False, cancel_futures=True)

    def _ask(self, key: Hashable, compute: Callable[[Check], Answer]) -> Answer:
        self._check()
        if not self.background:
            if key not in self._recent:  # several passes at one instant may repeat a question
                self.busy = True
                try:
                    answer = compute(self._check)
                finally:
                    self.busy = False
                self._recent = {**dict([*self._recent.items()][-1:]), key: answer}
            return cast("Answer", self._recent[key])
        question = self._questions.get(key)
        if question is None:
            from concurrent.futures import ThreadPoolExecutor  # only worlds with a clock need it

            self._pool = self._pool or ThreadPoolExecutor(2)
            self._questions[key] = question = Question()
            question.future = self._pool.submit(compute, partial(self._goes_on, question))
        question.asked = True
        assert question.future is not None
        if not question.future.done():
            self._awaited = True
            raise Pending
        return question.future.result()  # type: ignore[no-any-return]

    def _goes_on(self, question: Question) -> None:
        """Raise an exception if the run must end or this question has been abandoned."""
        self._check()
        if question.obsolete:
            raise Obsolete

    def _synthesized(self, specs: Sequence[Specification], check: Check) -> list[SynthesisResult]:
        def hear(progress: SynthesisProgress) -> None:
            check()
            if self._progress is not None and not self.background:
                self._progress(progress)

        return self._synthesizer.synthesize_all(specs, progress=hear)


def _refuse_limit(result: SynthesisResult) -> None:
    if not result.verdict.proven:
        of = "memory" if result.verdict is Verdict.OUT_OF_MEMORY else "time"
        limit = "limits.synthesis_memory" if of == "memory" else "limits.synthesis_seconds"
        raise ResourceLimitError(
            f"the synthesis for {result.robot} ran out of {of} after "
            f"{seconds_words(result.seconds)}; raise {limit} in the scenario"
        )
