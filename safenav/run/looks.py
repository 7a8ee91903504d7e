"""Look of each robot: shape, colour and letters, the same in every picture and page.

Colours are those of Okabe and Ito (Color Universal Design, 2008), distinct with every common
kind of colour blindness; shapes repeat what colours show. Paths are SVG path data in a square
from -1 to 1.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from msgspec import Struct

ORANGE = "#E69F00"
SKY = "#56B4E9"
GREEN = "#009E73"
YELLOW = "#F0E442"
BLUE = "#0072B2"
VERMILLION = "#D55E00"
PURPLE = "#CC79A7"
GREY = "#7A7F87"


class Look(Struct, frozen=True):
    """Look of one robot: body, and the colours of the body and of the letters on it.

    ``size`` of the letters and ``drop`` of their baseline are in radii of the body."""

    shape: str
    path: str
    colour: str
    ink: str
    letters: str
    size: float
    drop: float


_SHAPES = (
    ("circle", "M1,0A1,1 0 1 1 -1,0A1,1 0 1 1 1,0Z"),
    ("square", "M-0.86,-0.86H0.86V0.86H-0.86Z"),
    ("triangle", "M0,-1.2L1.12,0.82H-1.12Z"),
    ("diamond", "M0,-1.2L1.2,0L0,1.2L-1.2,0Z"),
    ("hexagon", "M-0.54,-0.94H0.54L1.08,0L0.54,0.94H-0.54L-1.08,0Z"),
    ("cross", "M-0.5,-1H0.5V-0.5H1V0.5H0.5V1H-0.5V0.5H-1V-0.5H-0.5Z"),
    ("pentagon", "M0,-1.1L1.05,-0.34L0.65,0.9H-0.65L-1.05,-0.34Z"),
)
_COLOURS = (
    (BLUE, "#FFFFFF"),
    (ORANGE, "#000000"),
    (GREEN, "#000000"),
    (PURPLE, "#000000"),
    (SKY, "#000000"),
    (VERMILLION, "#000000"),
    (YELLOW, "#000000"),
    (GREY, "#000000"),
)
_SIGNS = "0123456789abcdefghijklmnopqrstuvwxyz"
_NUMBERED = re.compile(r"(.*?)[-_ ]?0*(\d{1,2})")


def looks(names: Sequence[str]) -> tuple[Look, ...]:
    """Return a look for each robot: no two of the first 56 share both shape and colour."""
    letters = [*labels(names).values()]
    found = []
    for i in range(len(names)):
        shape, path = _SHAPES[i % len(_SHAPES)]
        colour, ink = _COLOURS[i % len(_COLOURS)]
        size = (1.05 if len(letters[i]) == 1 else 0.82) * (0.85 if shape == "triangle" else 1)
        drop = 0.36 * size + (0.22 if shape == "triangle" else 0)
        found.append(Look(shape, path, colour, ink, letters[i], round(size, 2), round(drop, 2)))
    return tuple(found)


def labels(names: Sequence[str]) -> dict[str, str]:
    """Return a label of at most two characters for each of up to 36 robots of one initial, no two
    the same: those of the terminal, the page and pictures.

    A robot alone with its initial gets that letter. Of several robots, the one named in one plain
    word keeps it (``quad`` beside ``quad_2``); others add their number (``Q2``) or the first letter
    that tells them apart (``drone``, ``digit``: ``Dr``, ``Di``). Numbers of two figures stand alone
    (``robot_11``: ``11``)."""
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
        return [initial, *(initial + sign for sign in _SIGNS)]
    found = []
    numbered = _NUMBERED.fullmatch(name)
    if numbered and numbered[1]:
        number = numbered[2]
        found.append(number if len(number) == 2 else initial + number)
    elif all(_NUMBERED.fullmatch(other) for other in rivals):
        found.append(initial)
    distinct = (
        letter
        for place, letter in enumerate(name)
        if place and all(letter != other[place : place + 1] for other in rivals)
    )
    found += [initial + letter.lower() for letter in distinct if letter.isalnum()]
    found += [initial + letter.lower() for letter in name[1:] if letter.isalnum()]
    return found + [initial + sign for sign in _SIGNS]
