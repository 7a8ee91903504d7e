"""Reasons why a run cannot begin or cannot continue, in the scenario's terms.

Combines the explanations of ``safenav.explain`` for one robot with the team's synthesis results at
the start of a scenario.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import TYPE_CHECKING

from safenav.errors import ResourceLimitError
from safenav.scenario.model import Scenario
from safenav.synthesis.request import Listener
from safenav.synthesis.slugs import Synthesizer

if TYPE_CHECKING:
    from safenav.explain.explanation import Explanation

QUESTION_SECONDS = 2.0
"""Wall time of one of the many synthesis requests of an explanation, in seconds."""


def explain_team(
    scenario: Scenario,
    synthesizer: Synthesizer,
    names: Collection[str] | None = None,
    progress: Listener | None = None,
) -> Iterator[Explanation]:
    """Yield the reasons and repairs for each robot (of those with these names) that is unrealizable
    at the start; nothing if all are realizable.

    Raises ResourceLimitError if a first verdict exceeds the limits.
    """
    # Imported here: most runs need no explanation.
    from safenav.explain.investigation import explain
    from safenav.runtime.run.mission import first_results

    limit = min(synthesizer.seconds or QUESTION_SECONDS, QUESTION_SECONDS)
    quick = Synthesizer(
        synthesizer.binary,
        seconds=limit,
        memory_mb=synthesizer.memory_mb,
        cache=synthesizer.cache,
    )
    for name, answer in first_results(scenario, synthesizer, progress, names).items():
        if answer.realizable:
            continue

        def judge(changed: Scenario, name: str = name) -> bool:
            try:
                answers = first_results(changed, quick, names=[name])
            except ResourceLimitError:
                return False
            return answers[name].realizable

        yield explain(scenario, answer.task, quick, judge)
