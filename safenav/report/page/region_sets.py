"""Sets of regions as short texts, each set written once.

A set is a list of runs of consecutive regions; of each run the gap before it and its length are
written: ``14,3,7,2``. Its reader is front/src/run/sets.ts."""

from __future__ import annotations

from collections.abc import Iterable

from msgspec import Struct, field

from safenav.world.map import Region


class RegionSets(Struct):
    """Collects sets; ``index`` is the index of one in ``texts``."""

    texts: list[str] = field(default_factory=list)
    _places: dict[str, int] = field(default_factory=dict)

    def index(self, regions: Iterable[Region]) -> int:
        """Return the index of the set with these regions, which must ascend."""
        text = written(regions)
        if text not in self._places:
            self._places[text] = len(self.texts)
            self.texts.append(text)
        return self._places[text]


def written(regions: Iterable[Region]) -> str:
    """Return regions, ascending, as gaps and lengths of runs."""
    numbers: list[int] = []
    end = 0
    for region in regions:
        if numbers and region == end:
            numbers[-1] += 1
        else:
            numbers += [region - end, 1]
        end = region + 1
    return ",".join(map(str, numbers))
