"""Motion of a robot model: ``motion: walker``."""

from __future__ import annotations

from functools import partial

from safenav.scenario import motion
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml import shapes
from safenav.scenario.yaml.document import Mapping, Node, clipped
from safenav.scenario.yaml.findings import Findings, suggestion
from safenav.world.moves import Mobility

MOTION = shapes.form(
    {"anyOf": [{"enum": list(motion.KINDS)}, shapes.TEXT]}, "motion", "The kind of its motion."
)


def read_motion(
    node: Node | None, model: Mapping, mobility: Mobility | None, what: str, findings: Findings
) -> str | None:
    """Return the kind of motion of a robot model; None if it has none or that was reported."""
    label = f"'motion' of {what}"
    kind = read.text(node, label, findings)
    if kind is None:
        return None
    known = motion.parameters(kind)
    if known is None:
        hint = suggestion(kind, motion.known_kinds())
        findings.add(node, f"{label}: unknown kind '{clipped(kind)}'", hint)
        return None
    if kind in motion.ONLY_WITH_HEADING and mobility is Mobility.FREE:
        hint = "it cannot turn around within a region: write 'mobility: heading'"
        findings.add(node, f"{label}: a {kind} moves with a heading", hint)
    for key in ("size", "speed"):
        if key in known:
            _read_number(model.get(key), known[key], f"'{key}' of {what}", findings)
    return kind


def _read_number(
    node: Node | None, parameter: motion.Parameter, what: str, findings: Findings
) -> None:
    """Report a number that a kind of motion does not take."""
    least, most = parameter.least, parameter.most
    limits = f"from {least:g} to {most:g}: {parameter.meaning}"
    reads = partial(read.within, allowed=lambda value: least <= value <= most, limits=limits)
    reads(node, what, findings)
