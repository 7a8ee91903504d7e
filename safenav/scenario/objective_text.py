"""Objectives as text: a short description, the notation of scenarios, data of a file."""

from __future__ import annotations

import json

from msgspec.structs import replace

from safenav.scenario.objective import Ltl, Objective, Target, Word, number_word
from safenav.scenario.yaml.document import flow


def to_data(objective: Objective) -> dict[str, object]:
    """Return the objective as it stands in a scenario or a trace, regions as numbers.

    A target of one region is a number, a larger one a sorted list.
    """
    if isinstance(objective, Ltl):
        memory = {n: list(b) if b else "bool" for n, b in objective.memory.items()}
        parts = {
            "init": list(objective.init),
            "safety": list(objective.safety),
            "liveness": list(objective.liveness),
            "memory": memory,
            "inputs": list(objective.inputs),
        }
        return {"ltl": {key: value for key, value in parts.items() if value}}
    regions = [sorted(target) for target in objective.targets]
    listed = [each[0] if len(each) == 1 else each for each in regions]
    rules = {
        "form": "literal" if objective.literal else None,
        "avoid": sorted(objective.avoid),
        "always": list(objective.always),
    }
    given = {key: value for key, value in rules.items() if value}
    return {objective.kind: listed[0] if objective.one else listed, **given}


_SHOWN = 2
"""The most formulas of ``always`` that ``describe`` lists."""


def describe(objective: Objective, word: Word = number_word) -> str:
    """Return the objective in a few words, for people: ``patrol 58 <-> 28``, or with
    ``RegionMap.word`` ``patrol dock <-> ward_a``."""
    if isinstance(objective, Ltl):
        safety, liveness = len(objective.safety), len(objective.liveness)
        return f"meet its formulas ({safety} safety, {liveness} liveness)"
    text = objective.words(word)
    if objective.avoid:
        text += f", never in {word(objective.avoid).replace('|', ', ')}"
    if len(objective.always) > _SHOWN:
        return f"{text}, always its {len(objective.always)} formulas"
    return text + "".join(f", always {formula}" for formula in objective.always)


def written(objective: Objective, word: Word = number_word) -> str:
    """Return the objective in the notation of scenarios: ``{patrol: [dock, shelf]}``."""

    def target(regions: Target) -> object:
        words = word(regions).split("|")
        return words[0] if len(words) == 1 else {"any": words}

    if isinstance(objective, Ltl):
        return json.dumps(to_data(replace(objective, inputs=())))  # the formulas name their inputs
    listed = [target(regions) for regions in objective.targets]
    rules = {
        "form": "literal" if objective.literal else None,
        "avoid": [word(region) for region in sorted(objective.avoid)] or None,
        "always": json.dumps(objective.always) if objective.always else None,
    }
    return flow({objective.kind: listed[0] if objective.one else listed, **rules})
