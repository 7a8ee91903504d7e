"""Words for obstacles, regions, times and lists, in texts for people."""

from collections.abc import Iterable

from safenav.scenario.model import name_parts
from safenav.scenario.objective import Word, number_word
from safenav.world.map import Region


def obstacle_words(name: str, word: Word = number_word) -> str:
    """Return the name of an obstacle: ``door@47``, or ``door@dock`` if the region has a name."""
    _, region, _ = name_parts(name)
    if not region.isdecimal():
        return name
    return name.replace(f"@{region}", f"@{word(int(region))}", 1)


def seconds_words(seconds: float) -> str:
    """Return a duration in a suitable unit: ``12 ms``, ``3.4 s``, ``2 min 5 s``."""
    if seconds < 0.0005:
        return "under 1 ms"
    if seconds < 0.9995:
        return f"{seconds * 1000:.0f} ms"
    if seconds < 59.95:
        return f"{seconds:.1f} s"
    return f"{round(seconds) // 60} min {round(seconds) % 60} s"


def moment_words(tick: int, seconds: float | None) -> str:
    """Return the moment of an event: ``in tick 31`` or, in a live run, ``after 2 min 5 s``."""
    return f"in tick {tick}" if seconds is None else f"after {seconds_words(seconds)}"


def regions_words(regions: Iterable[Region], word: Word = number_word) -> str:
    """Return regions as a short text: ``22-24, 35``; a single region by its name."""
    runs: list[tuple[int, int]] = []
    for region in sorted(regions):
        if runs and region == runs[-1][1] + 1:
            runs[-1] = (runs[-1][0], region)
        else:
            runs.append((region, region))
    return ", ".join(word(a) if a == b else f"{a}-{b}" for a, b in runs)


def listed(names: Iterable[str]) -> str:
    """Return ``a``, ``a and b`` or ``a, b and c``; ``no robot`` for no names."""
    words = list(names)
    if len(words) < 2:
        return words[0] if words else "no robot"
    return ", ".join(words[:-1]) + " and " + words[-1]


MANY = 8
"""Maximum number of robots named one by one in a line for people."""


def some(names: Iterable[str]) -> str:
    """Return names like ``listed``, but shorten many: ``a, b, c and 57 others``."""
    words = list(names)
    return listed(words if len(words) <= MANY else [*words[:3], f"{len(words) - 3} others"])


def shortened(rule: str) -> str:
    """Return the words of an assumption with a shortened list of many robots at the end:
    ``infinitely often no robot is beside it (a, b, c and 57 others)``."""
    words, found, listing = rule.rpartition(" (")
    names = listing.removesuffix(")").split(", ")
    return rule if not found or len(names) <= MANY else f"{words} ({some(names)})"


def counted(number: int, noun: str, plural: str = "") -> str:
    """Return a number with its noun: ``1 state``, ``2 states``. ``plural``: a plural without s."""
    return f"{number} {noun if number == 1 else plural or noun + 's'}"
