"""Good traces as files, and damage: the one way in which tests change the lines of a trace.

An edit names a ``line``: by its number in the file, or by its type, fields and place among those
(default: the first). It sets ``fields`` (by path: ``a.b`` is the field b of the field a), drops one
(``drop``), inserts a line behind it (``insert``: new if it has a type, otherwise a copy with these
fields), ends the run behind it (``cut``: fields of the outcome), or removes it, perhaps with all
``through`` another one. ``every``: all lines that fit. Several edits by number begin at the end.
"""

import json
from collections.abc import Callable, Sequence
from copy import deepcopy
from functools import partial
from pathlib import Path
from typing import Any

Line = dict[str, Any]
Edit = dict[str, Any]
FOLDER = Path(__file__).parents[1] / "judge" / "good"


def read(file: Path) -> list[Line]:
    return [json.loads(line) for line in file.read_text().splitlines()]


GOOD: dict[str, Callable[[], list[Line]]] = {
    file.stem: partial(read, file) for file in sorted(FOLDER.glob("*.jsonl"))
}
"""Traces of correct runs."""


def live(lines: list[Line]) -> bool:
    """Whether a trace is of a run in seconds."""
    return bool(lines[0]["scenario"]["clock"] == "live")


def text(lines: list[Line]) -> list[str]:
    return [json.dumps(line) for line in lines]


def value(line: Any, path: str) -> Any:
    for key in path.split("."):
        listed = isinstance(line, list)
        line = line[_number(line, key)] if listed else (line or {}).get(key)
    return line


def _number(listed: list[Any], key: str) -> int:
    """The number of an item, perhaps by its name; a new one comes last."""
    if key.isdigit():
        return int(key)
    names = [item.get("name") for item in listed if isinstance(item, dict)]
    return names.index(key) if key in names else len(listed)


def team(header: Line) -> dict[str, Line]:
    """The robots of a trace by name."""
    return {robot["name"]: robot for robot in header["scenario"]["robots"]}


def fits(line: Line, fields: Line) -> bool:
    """Whether a line has these fields; a text that begins with ``...`` is a part of the field."""
    for path, expected in fields.items():
        found = value(line, path)
        if isinstance(expected, str) and expected.startswith("..."):
            if expected[3:] not in (found or ""):
                return False
        elif found != expected:
            return False
    return True


def find(lines: list[Line], kind: str, fields: Line | None = None, nth: int = 0) -> int:
    """The position of a line of a type with these fields."""
    return [k for k, one in enumerate(lines) if fits(one, {"type": kind} | (fields or {}))][nth]


def damage(lines: list[Line], edits: Sequence[Edit]) -> list[Line]:
    """Return the lines after these edits."""
    lines = deepcopy(lines)
    for edit in edits:
        where = edit["line"]
        if edit.get("every"):
            kind, *rest = where
            fields = {"type": kind} | (rest[0] if rest else {})
            for k in reversed([k for k, one in enumerate(lines) if fits(one, fields)]):
                _edit(lines, k, edit)
        else:
            _edit(lines, where - 1 if isinstance(where, int) else find(lines, *where), edit)
    return lines


def _edit(lines: list[Line], k: int, edit: Edit) -> None:
    for path, new in edit.get("fields", {}).items():
        place, key = _place(lines[k], path)
        if isinstance(place, list) and key == len(place):
            place.append(None)
        place[key] = deepcopy(new)
    if drop := edit.get("drop"):
        place, key = _place(lines[k], drop)
        del place[key]
    elif "insert" in edit:
        new = deepcopy(edit["insert"])
        here = {"tick": lines[k].get("tick", 0)} if "type" in new else deepcopy(lines[k])
        lines.insert(k + 1, here | new)
    elif "cut" in edit:
        _cut(lines, k + 1, edit["cut"])
    elif "fields" not in edit:
        del lines[k : edit.get("through", k + 1)]


def _cut(lines: list[Line], at: int, fields: Line) -> None:
    """Let the run end before a line, with counts that fit."""
    last = lines[-1]
    del lines[at:]
    tick = lines[-1].get("tick", 0)
    rounds = dict.fromkeys(team(lines[0]), 0)
    rounds |= {line["robot"]: line["round"] for line in lines if line["type"] == "goal"}
    for key in ("cause", "proof", "unrealizable"):
        last.pop(key, None)
    lines.append(last | {"tick": tick, "ticks": tick, "rounds": rounds} | deepcopy(fields))


def _place(line: Line, path: str) -> tuple[Any, Any]:
    """The container of a field and its key there."""
    parent, _, key = path.rpartition(".")
    place = value(line, parent) if parent else line
    return place, _number(place, key) if isinstance(place, list) else key
