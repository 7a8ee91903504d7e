"""The ``never_together:`` of a scenario: robots of which at most one is in some regions."""

from __future__ import annotations

from collections.abc import Sequence

from safenav.scenario.model import Robot, Tracking
from safenav.scenario.reading.regions import TARGET, RegionReader
from safenav.scenario.settings import Exclusion
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml.document import Node, clipped
from safenav.scenario.yaml.document import Sequence as ListNode
from safenav.scenario.yaml.findings import Findings, suggestion
from safenav.scenario.yaml.shapes import TEXT, Key, Shape, Table, either, form, many
from safenav.world.map import Region


class ExclusionKeys(Table):
    robots = Key(
        Shape(many(TEXT, 2), read.words),
        "At least two robots.",
        required="name two robots or more, for example 'robots: [quad, digit]'",
    )
    in_ = Key(
        form(either(TARGET, many(TARGET, 1))),
        "Regions for at most one of them.",
        required="name regions or areas, for example 'in: bridge'",
        name="in",
    )


NEVER_TOGETHER = form(many(ExclusionKeys))


def read_never_together(
    node: Node | None,
    regions: RegionReader,
    team: Sequence[Robot],
    named: frozenset[str],
    findings: Findings,
) -> tuple[Exclusion, ...]:
    """The exclusions that could be read; what is wrong with the others is reported. ``team``: the
    robots that could be read, of all that are ``named``."""
    known, found = {robot.name: robot for robot in team}, []
    for part in read.sequence(node, "never_together", findings) or ():
        what = "never_together"
        item = ExclusionKeys.read(part, f"an entry of {what}", findings, f"of {what}")
        if item is None:
            continue
        before, place, where = len(findings), item.where(ExclusionKeys.robots), item.in_
        names = item.robots or frozenset()
        for name in sorted(names - named):
            findings.add(place, f"no robot is named '{clipped(name)}'", suggestion(name, named))
        if place is not None and len(names) < 2 and len(findings) == before:
            findings.add(place, "'robots' of never_together: at least two robots are needed")
        zone = _zone(where, regions, findings)
        together = sorted(n for n in names & {*known} if zone and known[n].start.region in zone)
        if len(together) > 1:
            said = f"{together[0]} and {together[1]} both start there"
            findings.add(where, f"'in' of never_together: {said}", "let one start elsewhere")
        for name in sorted(names & {*known}):
            if known[name].tracking is not Tracking.NEARBY:
                said = f"'tracking: {known[name].tracking.value}' of {name}"
                hint = "leave it out: 'tracking: nearby' observes regions that are taken"
                findings.add(place, f"never_together does not work with {said}", hint)
        if len(findings) == before and zone is not None:
            found.append(Exclusion(names, zone))
    return tuple(found)


def _zone(node: Node | None, regions: RegionReader, findings: Findings) -> frozenset[Region] | None:
    what = "'in' of never_together"
    if not isinstance(node, ListNode):
        return regions.target(node, what)
    parts = regions.targets(node, what) or ()
    if not node.items:
        findings.add(node, f"{what} is empty", "name at least one region")
    sets = [part for part in parts if part is not None]
    return frozenset().union(*sets) if parts and len(sets) == len(parts) else None
