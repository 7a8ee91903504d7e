"""Sets of regions as short texts, each set written once.

A set is a list of runs of consecutive regions; of each run the gap before it and its length are
written as numbers in base 32, little end first, with one letter per digit: an upper half of the
alphabet marks that the number continues (as in the base64 VLQ of source maps). A set within a
radius of 4 takes about 20 letters. Its reader is front/src/run/sets.ts."""

from __future__ import annotations

from collections.abc import Iterable

from msgspec import Struct, field

from safenav.world.map import Region

_DIGITS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_"
_BASE = len(_DIGITS) // 2


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
    text, end = "", 0
    start = None
    for region in regions:
        if start is None:
            start, gap = region, region - end
        elif region != end:
            text += _number(gap) + _number(end - start)
            start, gap = region, region - end
        end = region + 1
    return text if start is None else text + _number(gap) + _number(end - start)


def _number(value: int) -> str:
    text = ""
    while value >= _BASE:
        value, digit = divmod(value, _BASE)
        text += _DIGITS[_BASE + digit]
    return text + _DIGITS[value]
