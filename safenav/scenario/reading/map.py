"""The ``map:`` of a scenario, drawn in it or read from a file, with names and metres; and map files
without a scenario, for drawings."""

from collections.abc import Mapping as Names
from pathlib import Path

from msgspec.structs import replace

from safenav.errors import Diagnostic, InputError, install_command
from safenav.files import ROS_MAP, kind_of
from safenav.scenario import language
from safenav.scenario.language import FORMS, MapKeys
from safenav.scenario.reading.regions import Reading, too_large
from safenav.scenario.yaml.document import Mapping, Node, Place, Scalar, Sequence, clipped, node_of
from safenav.scenario.yaml.findings import Findings, described, read_source, wrong_type
from safenav.scenario.yaml.typed import read
from safenav.strict_json import MOST_REGIONS
from safenav.world.map import FREE, WALL, Frame, RegionMap


def resolve_map(item: language.MapKeys | None, _: Node | None, reading: Reading) -> None:
    """Add the map and its names to ``reading``. After a reported error in the map, add only its
    names."""
    names = None if item is None else item.at("names")
    cut = isinstance(names, Mapping) and names.cut
    unread = item is None or cut or (names is not None and item.names is None)
    reading.names_known = reading.names_known and not unread
    if item is not None:
        reading.world = _read_form(item, reading)
        _resolve_names(item, reading)


def _read_form(item: language.MapKeys, reading: Reading) -> RegionMap | None:
    forms = [form for form in FORMS if item.at(form) is not None]
    given = getattr(item, forms[0]) if len(forms) == 1 else None
    if given is None:
        return None
    (form,), frame = forms, _frame(item)
    if form == "grid":
        world = read_grid(given.node, reading)
        return world and replace(world, frame=frame)
    try:  # only map files need numpy, whose import takes longer than to read a scenario
        from safenav.scenario.reading import map_file
    except ImportError:
        hint = f"{install_command('maps')}\n    or draw the map with 'grid'"
        reading.add(given, "a map file needs numpy, which is not installed", hint)
        return None
    if form == "ros":
        return map_file.read_ros(given, item, reading)
    world = map_file.read_drawing(form, given, item, reading)
    return world and replace(world, frame=frame)


def _frame(item: language.MapKeys) -> Frame | None:
    """Return the frame of the map; None if the scenario omits the size of regions."""
    side, origin = item.resolution, item.origin
    if side is None:
        return None
    x, y, yaw = (*(origin or (0.0, 0.0)), 0.0)[:3]
    return Frame(side, (x, y), yaw)


def _resolve_names(item: language.MapKeys, reading: Reading) -> None:
    names = {
        key.text: reading.region(value.node, f"region '{clipped(key.text)}'")
        for key, value in (item.names or {}).items()
    }
    if reading.world is not None:
        known = {name: region for name, region in names.items() if region is not None}
        reading.world = replace(reading.world, names=known)
    reading.names = names


_OF_FILES = {".png": "image", ".pgm": "image", ".map": "movingai"}


def form_of(path: Path) -> str | None:
    """Return the key of a map file in a scenario, ``image``, ``ros`` or ``movingai``; None for
    other files."""
    suffix = path.suffix.lower()
    if suffix in (".yaml", ".yml"):
        return "ros" if kind_of(read_source(path, Findings(str(path))) or "") == ROS_MAP else None
    return _OF_FILES.get(suffix)


def load_map(path: Path, form: str, division: Names[str, float | None]) -> RegionMap:
    """Return the map in a map file. ``division``: the keys that divide it into regions (None: not
    given). Raises InputError with all errors."""
    if not path.is_file():
        message = "this is a directory" if path.is_dir() else "no such file"
        raise InputError([Diagnostic(str(path), 0, 0, message, "check the path")])
    reading = Reading(str(path))
    given = {key: value for key, value in division.items() if value is not None}
    root = node_of({form: path.name, **given}, Place(0, 0))
    resolve_map(read(MapKeys, root, "map", reading), root, reading)
    reading.raise_if_any()
    assert reading.world is not None, "else it was reported"
    return reading.world


_CHARACTERS = frozenset({WALL, FREE})


def read_grid(node: Node, findings: Findings) -> RegionMap | None:
    """Return the map in a ``grid``; None after an error was reported."""
    before, rows = len(findings), _rows(node, findings)
    filled = [number for number, (_, row) in enumerate(rows) if row]
    rows = rows[filled[0] : filled[-1] + 1] if filled else []
    if not rows and len(findings) == before:
        hint = "write 'grid: |' and below it one indented line of '#' and '.' for each row"
        findings.add(node, "the grid is empty", hint)
    for number, (place, row) in enumerate(rows):
        if not _CHARACTERS.issuperset(row):
            odd = next(i for i, char in enumerate(row) if char not in _CHARACTERS)
            at = replace(place, column=place.column + odd)
            found = f"row {number}, column {odd} of the map: found '{clipped(row[odd])}'"
            findings.add(at, found, "expected '#' (wall) or '.' (free)")
        elif len(row) != (cols := len(rows[0][1])):
            found = f"ragged map: row {number} has {len(row)} characters, row 0 has {cols}"
            findings.add(place, found, "give all rows of the grid the same length")
    if rows and len(rows) * len(rows[0][1]) > MOST_REGIONS:
        findings.add(node, *too_large(len(rows), len(rows[0][1])))
    return RegionMap.from_grid(row for _, row in rows) if len(findings) == before else None


def _rows(node: Node, findings: Findings) -> list[tuple[Place, str]]:
    """Return the rows of the grid without trailing blanks, each with its place in the file; none
    after a reported error."""
    rows = list[tuple[Place, str]]()
    if isinstance(node, Sequence):
        for item in node.items:
            if not isinstance(item, Scalar) or not isinstance(item.value, str):
                found = f"a row of the grid: found {described(item)}, expected text"
                hint = "quote rows in a list: without quotes '#' is a comment"
                findings.add(item, found, hint)
                return []
            column = item.place.column + bool(item.style)
            rows.append((replace(item.place, column=column), item.value.rstrip()))
    elif not isinstance(node, Scalar) or not isinstance(node.value, str | None):
        wrong_type(node, "'grid' of map", "a block of text ('grid: |')", findings)
    elif node.style != "|" and " " in (node.value or "").strip():
        hint = "write 'grid: |' so that line breaks are kept"
        findings.add(node, "the rows of the grid run together", hint)
    else:
        for line, text in enumerate((node.value or "").split("\n"), node.place.line + 1):
            row, written = text.rstrip(), "".join(findings.lines[line - 1 : line]).rstrip()
            place = Place(line, max(0, len(written) - len(row)) + 1)
            rows.append((place if node.style == "|" else node.place, row))
        ended = node.style == "|" and not rows[-1][1]
        below = "".join(findings.lines[line - 1 : line] if ended else ()).rstrip()
        row = below.lstrip()
        if below[:1] == " " and len(row) == len(rows[0][1]) and _CHARACTERS.issuperset(row):
            found = "this line looks like a row of the grid, but is a comment"
            place = Place(line, len(below) - len(row) + 1)
            findings.add(place, found, "indent it like the rows above")
            return []
    return rows
