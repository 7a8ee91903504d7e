"""The ``inputs:`` of a scenario: Booleans that the environment sets."""

from __future__ import annotations

import re

from safenav.formula.syntax import RESERVED_WORDS
from safenav.scenario.reading.naming import IDENTIFIER, well_named
from safenav.scenario.reading.objective import OWN_VARIABLES, VARIABLE
from safenav.scenario.reading.obstacles import MOST_TICKS, TICK
from safenav.scenario.reading.regions import Reading
from safenav.scenario.settings import Input
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml import shapes
from safenav.scenario.yaml.document import Node, Scalar, Sequence, clipped
from safenav.scenario.yaml.findings import Findings

TAKEN = {"move", "scout", "goal", "request", "wait", "assigned"}
"""Variables that specifications declare themselves, with those of the following prefixes."""
_PREFIXES = ("busy_", "at_")
_SPAN = re.compile(r"(\d{1,9})(?:\s*-\s*(\d{1,9}))?")
_AGAIN = {"off": (False,), "on": (True,), "both": (False, True)}
_TICKS = shapes.either(TICK, shapes.matching(_SPAN))


def _spans(node: Node | None, what: str, findings: Findings) -> tuple[tuple[int, int], ...]:
    """Return ticks and ranges of ticks: ``12``, ``10-20``, or a list of both."""
    found = []
    for part in node.items if isinstance(node, Sequence) else () if node is None else (node,):
        text = str(part.value) if isinstance(part, Scalar) else ""
        match = _SPAN.fullmatch(text)
        first, last = (int(match[1]), int(match[2] or match[1])) if match else (0, 0)
        if not 1 <= first <= last <= MOST_TICKS:
            hint = "for example at: [12, 20-30]; ticks count from 1"
            told = f"{what}: found {read.described(part)}, expected a tick or a range of ticks"
            findings.add(part, told, hint)
        found.append((first, last))
    return tuple(found)


def _again(node: Node | None, what: str, findings: Findings) -> tuple[bool, ...]:
    """Return the values of ``off``, ``on`` or ``both``; YAML may read two of them as Booleans."""
    if node is None:
        return ()
    value = node.value if isinstance(node, Scalar) else None
    word = {True: "on", False: "off"}.get(value) if isinstance(value, bool) else value
    if not isinstance(word, str) or word not in _AGAIN:
        found = f"{what}: found {read.described(node)}, expected off, on or both"
        findings.add(node, found, "the value that the input has infinitely often")
        return ()
    return _AGAIN[word]


class InputKeys(shapes.Table):
    example = "{at: 12-30}; {} for one that a program sets"
    at = shapes.Key(
        shapes.Shape(shapes.either(_TICKS, shapes.many(_TICKS)), _spans),
        "Ticks when a simulation has it on: 12, 20-30 or a list.",
    )
    probability = shapes.Key(
        shapes.PROBABILITY,
        "Probability of being on in each other tick of a simulation. Default: 0.",
    )
    always_eventually = shapes.Key(
        shapes.Shape({"enum": [*_AGAIN, True, False]}, _again),
        "Assumed infinitely often: off, on or both.",
    )


_RESERVED = shapes.either({"enum": sorted(TAKEN)}, {"pattern": f"^({'|'.join(_PREFIXES)})"})
INPUTS = shapes.form(shapes.named(InputKeys, {"allOf": [VARIABLE, {"not": _RESERVED}]}))


def read_inputs(node: Node | None, reading: Reading) -> tuple[Input, ...]:
    """Return the named inputs; errors are reported."""
    item, found = read.mapping(node, "inputs", reading, example="{alarm: {at: 12-30}}"), []
    taken = RESERVED_WORDS | OWN_VARIABLES | TAKEN | {*reading.named}
    for key, value in item.entries if item else ():
        name = clipped(key.text)
        what = f"input {name}"
        reserved = key.text in taken or key.text.startswith(_PREFIXES)
        if well_named(key, "an input", reading, IDENTIFIER) and reserved:
            reading.add(key, f"'{name}' is reserved", "use another name")
        fields = InputKeys.read(value, what, reading)
        if fields is None:
            found.append(Input(key.text))
            continue
        spans, again = fields.at or (), fields.always_eventually or ()
        found.append(Input(key.text, spans, fields.probability or 0.0, again))
    return tuple(found)
