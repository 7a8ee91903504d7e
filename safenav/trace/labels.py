"""One or two characters for each robot: the same on the terminal, the page and pictures."""

from __future__ import annotations

import re
from collections.abc import Sequence
from string import ascii_lowercase, digits

_NUMBERED = re.compile(r"(.*?)[-_ ]?0*(\d{1,2})")


def labels(names: Sequence[str]) -> dict[str, str]:
    """Return a label of at most two characters for each of up to 36 robots of one initial, no two
    the same.

    A robot alone with its initial gets that letter. Of several the one that is named in one
    plain word keeps it (``quad`` beside ``quad_2``); others add their number (``Q2``) or the
    first letter that tells them apart (``drone``, ``digit``: ``Dr``, ``Di``). Numbers of two
    figures stand alone (``robot_11``: ``11``)."""
    chosen: dict[str, str] = {}
    for name in names:
        for label in _candidates(name, names):
            if label not in chosen.values():
                chosen[name] = label
                break
        else:
            chosen[name] = str(len(chosen) + 1)
    return chosen


def _candidates(name: str, names: Sequence[str]) -> list[str]:
    """Return possible labels of a name, the best first."""
    initial = name[:1].upper()
    rivals = [other for other in names if other != name and other[:1].upper() == initial]
    if not rivals:
        return [initial, *(initial + sign for sign in digits + ascii_lowercase)]
    found = []
    numbered = _NUMBERED.fullmatch(name)
    if numbered and numbered[1]:
        number = numbered[2]
        found.append(number if len(number) == 2 else initial + number)
    elif all(_NUMBERED.fullmatch(other) for other in rivals):
        found.append(initial)
    telling = (
        letter
        for place, letter in enumerate(name)
        if place and all(letter != other[place : place + 1] for other in rivals)
    )
    found += [initial + letter.lower() for letter in telling if letter.isalnum()]
    found += [initial + letter.lower() for letter in name[1:] if letter.isalnum()]
    return found + [initial + sign for sign in digits + ascii_lowercase]
