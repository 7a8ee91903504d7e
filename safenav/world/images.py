"""Map files: images (PGM, the format of ROS, and PNG; dark is wall) and MovingAI maps.

Sizes are checked before any decoding, since a small file can claim to be a huge image.

Each format defines whether a pixel is blocked or free. A region covers a rectangle of pixels. If
borders of regions and pixels differ, a pixel counts for each region by their common area. A region
is a wall if any of its area is blocked, so a free region is entirely free. With a ``share`` above
0, at least that part of its area must be blocked, so specks and walls slightly off the grid do not
count. Areas are integers, so the rule is exact; only the comparison with a share above 0 is in
floating point, with a tolerance of a billionth.
"""

from __future__ import annotations

import re
from fractions import Fraction
from io import BytesIO
from itertools import pairwise
from math import ceil, floor
from typing import TYPE_CHECKING, Any
from warnings import catch_warnings, simplefilter

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from safenav.errors import Diagnostic, InputError, install_command
from safenav.world.map import Region, RegionMap

if TYPE_CHECKING:
    from PIL.Image import Image as Picture

Blocked = NDArray[np.bool_]
"""Rows of pixels from the north; true: blocked."""

_TOLERANCE = 1e-9
_FINEST = 1000
"""Region borders lie on multiples of at least a thousandth of a pixel, so the integers below stay
small."""


class Layout(Struct, frozen=True):
    """A map of ``rows`` x ``cols`` regions over pixels: each is ``height`` x ``width`` pixels.

    The south-western corners of both coincide; regions may extend beyond the pixels in the north
    and the east, where all is blocked.
    """

    rows: int
    cols: int
    height: Fraction
    width: Fraction

    @classmethod
    def of_count(cls, blocked: Blocked, rows: int, cols: int) -> Layout:
        """Return the layout that divides all pixels into this many rows and columns."""
        return cls(rows, cols, Fraction(blocked.shape[0], rows), Fraction(blocked.shape[1], cols))

    @classmethod
    def of_size(cls, blocked: Blocked, side: Fraction) -> Layout:
        """Return a layout of square regions of ``side`` pixels. The last may be incomplete."""
        side = side.limit_denominator(_FINEST)
        rows, cols = (ceil(pixels / side) for pixels in blocked.shape)
        return cls(rows, cols, side, side)


def walls(blocked: Blocked, layout: Layout, share: float = 0.0) -> frozenset[Region]:
    """Return the walls. ``share``: the least blocked share of a wall's area; 0: any part."""
    free = ~blocked[::-1]  # from the south, where both begin
    down, aside = (layout.height, layout.rows), (layout.width, layout.cols)
    if layout.rows * free.shape[1] < layout.cols * free.shape[0]:  # this order needs fewer sums
        areas = _sums(_sums(free, *down).T, *aside).T[::-1]
    else:
        areas = _sums(_sums(free.T, *aside).T, *down)[::-1]
    whole = layout.height.numerator * layout.width.numerator
    found = areas < whole if share == 0 else areas <= (1 - share + _TOLERANCE) * whole
    return frozenset(np.flatnonzero(found).tolist())


def _sums(lines: NDArray[Any], side: Fraction, count: int) -> NDArray[np.int64]:
    """Return, for each region along one axis, the sum of the pixel lines that it covers, each
    multiplied by their common length. A pixel is as long as the denominator of ``side``, so lengths
    are integers."""
    long, unit = side.numerator, side.denominator
    borders = np.minimum(np.arange(count + 1) * long, len(lines) * unit)
    first, part = np.divmod(borders, unit)  # each border's pixel and its part before the border
    whole = np.stack([lines[begin:end].sum(axis=0) for begin, end in pairwise(first)])
    edges = lines[np.minimum(first, len(lines) - 1)] * part[:, None]
    return whole * unit + np.diff(edges, axis=0)


def flaw(found: str, hint: str = "", line: int = 0, column: int = 0) -> Diagnostic:
    """Return the diagnostic of a defect in a map file."""
    return Diagnostic("", line, column, found, hint)


MAX_PIXELS = 2**25
_CONVERT = "save it as PNG or PGM"
_GAP = rb"(?:\s|#[^\r\n]*[\r\n])+"
_NUMBERS = _GAP + rb"(\d{1,9})" + _GAP + rb"(\d{1,9})" + _GAP + rb"([1-9]\d{0,4})\s"
_PGM = re.compile(rb"(P[25])" + _NUMBERS)


class Image(Struct, frozen=True):
    """Pixels in rows from the top: brightness (the sum of the channels, 0 to ``white``) and
    transparency (None: no pixel is transparent)."""

    brightness: NDArray[np.uint16]
    white: int
    transparent: Blocked | None = None


def read_image(data: bytes) -> Image:
    """Return the pixels of an image file. Raises InputError."""
    if not data:
        raise InputError([flaw("the file is empty", _CONVERT)])
    if data.startswith((b"P2", b"P5")):
        return _pgm(data)
    if data.startswith(b"\x89PNG"):
        return _png(data)
    raise InputError([flaw("neither a PNG nor a PGM image", _CONVERT)])


def _check_size(width: int, height: int) -> None:
    found = f"an image of {width} x {height} pixels"
    if not width * height:
        raise InputError([flaw(found, "save it again: it is empty")])
    if width * height > MAX_PIXELS:
        hint = "scale it down: a few pixels for each region are enough"
        raise InputError([flaw(f"{found}; the maximum is {MAX_PIXELS}", hint)])


def _pgm(data: bytes) -> Image:
    """Return the pixels of a PGM, plain (P2) or binary (P5). Pillow would ignore pixels beyond the
    header's number and brightness above its maximum."""
    head = _PGM.match(data)
    if head is None:
        hint = "expected: 'P2' or 'P5', then width, height and the brightest value"
        raise InputError([flaw("a broken image: the header of a PGM is not complete", hint)])
    width, height, white = (int(number) for number in head.groups()[1:])
    _check_size(width, height)
    body, count = data[head.end() :], width * height
    if head[1] == b"P5":
        size = 1 if white < 256 else 2
        body = body[: count * size] + body[count * size :].rstrip()  # a final line end is allowed
        found = np.frombuffer(body, np.uint8 if size == 1 else ">u2", len(body) // size)
        given = len(body) / size
    else:
        with catch_warnings():
            simplefilter("error")
            try:
                found = np.fromstring(re.sub(rb"#[^\r\n]*", b"", body), np.int64, sep=" ")
            except (DeprecationWarning, OverflowError, ValueError):
                hint = "the pixels of 'P2' are whole numbers"
                raise InputError([flaw("a broken image: not a number", hint)]) from None
        given = len(found)
    if given != count:
        hint = "check width and height in the header, or copy it again"
        what = f"{given:.10g} pixels where the header announces {count}"
        raise InputError([flaw(what, hint)])
    least, most = int(found.min()), int(found.max())
    if not 0 <= least <= most <= white <= 65535:
        what = f"pixels from {least} to {most} where the header announces 0 to {white}"
        hint = "the third number of the header is the brightest value, at most 65535"
        raise InputError([flaw(what, hint)])
    return Image(found.astype(np.uint16).reshape(height, width), white)


def _png(data: bytes) -> Image:
    try:
        from PIL import Image as Pillow
        from PIL import UnidentifiedImageError
    except ImportError:
        hint = install_command("maps")
        raise InputError([flaw("a PNG needs Pillow, which is not installed", hint)]) from None
    if len(data) >= 24:  # before Pillow applies its own limits
        _check_size(int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big"))
    try:
        with Pillow.open(BytesIO(data), formats=["PNG"]) as picture:
            _check_size(*picture.size)  # the size in the last header; other chunks may precede it
            picture.load()
            return _decoded(picture)
    except InputError:
        raise
    except UnidentifiedImageError:
        raise InputError([flaw("a broken image: not the header of a PNG", _CONVERT)]) from None
    except Exception as error:  # Pillow raises all kinds of errors
        reason = str(error).splitlines()[0][:100] if str(error) else type(error).__name__
        raise InputError([flaw(f"a broken image: {reason}", "save it again")]) from None


def dark(image: Image) -> Blocked:
    """Return the pixels that are darker than half of white. Transparent pixels count as white."""
    found: Blocked = (2 * np.arange(image.white + 1) < image.white)[image.brightness]
    return found if image.transparent is None else found & ~image.transparent


def _decoded(picture: Picture) -> Image:
    if picture.mode.startswith("I"):  # 16 bits of gray
        return Image(np.asarray(picture.convert("I")).astype(np.uint16), 65535)
    if picture.mode in ("1", "L") and "transparency" not in picture.info:
        return Image(np.asarray(picture.convert("L")).astype(np.uint16), 255)
    channels = np.asarray(picture.convert("RGBA"))
    brightness = channels[..., :3].sum(axis=2, dtype=np.uint16)
    transparent = channels[..., 3] < 128
    hidden = transparent if bool(transparent.any()) else None
    return Image(brightness, 3 * 255, hidden)


def crossed(blocked: Blocked, layout: Layout, world: RegionMap) -> list[Region]:
    """Return the free regions that blocked pixels cross from one side to the opposite one."""
    found = []
    for region in world.free:
        row, col = world.position(region)
        south = blocked.shape[0] - (world.rows - 1 - row) * layout.height
        top, bottom = max(0, floor(south - layout.height)), ceil(south)
        left, right = floor(col * layout.width), ceil((col + 1) * layout.width)
        part = blocked[top:bottom, left:right]
        if part.any() and (part.any(axis=0).all() or part.any(axis=1).all()):
            found.append(region)
    return found


FREE = frozenset(".GSE")
WALLS = frozenset("@OTW")

_HEADER = {
    "type octile": "type (octile|tile)",
    "height N": "height ([1-9][0-9]{0,5})",
    "width N": "width ([1-9][0-9]{0,5})",
    "map": "map",
}
"""The first lines of a file and their patterns."""


def read_movingai(text: str) -> Blocked:
    """Return the characters of a MovingAI map that are walls. Raises InputError with all errors.

    The format is that of Sturtevant's benchmarks (2012): ``type octile``, ``height`` and ``width``,
    then ``map`` and the rows. Ground (``.`` and ``G``) and swamp (``S``) are free. In maps of the
    League of Robot Runners ``E`` (emitter) and ``S`` (service point) are also free. Trees (``T``),
    cells out of bounds (``@`` and ``O``) and water (``W``, which robots cannot enter from land) are
    walls.
    """
    lines = [line.rstrip() for line in text.rstrip().splitlines()]
    words = list[str]()
    for number, (expected, pattern) in enumerate(_HEADER.items(), 1):
        line = lines[number - 1] if number <= len(lines) else ""
        match = re.fullmatch(pattern, " ".join(line.split()))
        if match is None:
            found = f"found '{line[:40]}', expected '{expected}'"
            hint = f"the file begins with the lines {', '.join(_HEADER)}"
            raise InputError([flaw(found, hint, number, 1)])
        words += match.groups()
    height, width = int(words[1]), int(words[2])
    rows, flaws = lines[len(_HEADER) :], []
    known = "".join(sorted(FREE | WALLS))
    for number, row in enumerate(rows, len(_HEADER) + 1):
        if odd := row.lstrip(known):
            column, shown = row.index(odd[0]) + 1, odd[0] if odd[0].isprintable() else "?"
            found, hint = f"'{shown}' is not a terrain", f"known: {' '.join(known)}"
            flaws.append(flaw(found, hint, number, column))
        if len(row) != width:
            found = f"a row of {len(row)} characters where the header announces {width}"
            flaws.append(flaw(found, "check 'width'", number, 1))
    if len(rows) != height:
        found = f"{len(rows)} rows where the header announces {height}"
        flaws.append(flaw(found, "check 'height'", len(lines), 1))
    if flaws:
        raise InputError(flaws)
    return np.array([[char in WALLS for char in row] for row in rows])
