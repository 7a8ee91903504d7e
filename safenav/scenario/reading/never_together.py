"""The ``never_together:`` of a scenario: robots of which at most one is in some regions."""

from __future__ import annotations

from safenav.scenario.model import Tracking
from safenav.scenario.reading.regions import TARGET, Reading
from safenav.scenario.settings import Exclusion
from safenav.scenario.yaml import fields as read
from safenav.scenario.yaml.document import Node
from safenav.scenario.yaml.document import Sequence as ListNode
from safenav.scenario.yaml.shapes import TEXT, Key, Shape, Table, either, form, many


class ExclusionKeys(Table):
    example = "{robots: [quad, digit], in: [47]}"
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


def _exclusions(node: Node | None, _what: str, reading: Reading) -> tuple[Exclusion, ...]:
    """Return the readable exclusions; errors in the others are reported."""
    known, found = {robot.name: robot for robot in reading.team}, []
    for part in read.sequence(node, "never_together", reading) or ():
        what = "never_together"
        item = ExclusionKeys.read(part, f"an entry of {what}", reading, f"of {what}")
        if item is None:
            continue
        before, place, where = len(reading), item.where(ExclusionKeys.robots), item.in_
        names = item.robots or frozenset()
        for name in sorted(names - {*reading.named}):
            reading.unknown(place, "no robot is named", name, reading.named)
        if place is not None and len(names) < 2 and len(reading) == before:
            reading.add(place, "'robots' of never_together: at least two robots are needed")
        what = f"'in' of {what}"
        zone = reading.zone(where, what)
        if isinstance(where, ListNode) and not where.items:
            reading.add(where, f"{what} is empty", "name at least one region")
        together = sorted(n for n in names & {*known} if zone and known[n].start.region in zone)
        if len(together) > 1:
            said = f"{together[0]} and {together[1]} both start there"
            reading.add(where, f"{what}: {said}", "let one start elsewhere")
        for name in sorted(names & {*known}):
            if known[name].tracking is not Tracking.NEARBY:
                said = f"'tracking: {known[name].tracking.value}' of {name}"
                hint = "leave it out: 'tracking: nearby' observes which regions are occupied"
                reading.add(place, f"never_together does not work with {said}", hint)
        if len(reading) == before and zone is not None:
            found.append(Exclusion(names, zone))
    return tuple(found)


NEVER_TOGETHER = Shape(many(ExclusionKeys), _exclusions)
