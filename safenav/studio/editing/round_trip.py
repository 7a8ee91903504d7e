"""Changes of values in YAML text that keep comments, order and spacing.

ruamel.yaml keeps comments and order, but changes spacing. So its output before and after a change
is compared, and only the lines that differ are put into the text.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from difflib import SequenceMatcher
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.error import YAMLError

from safenav.errors import UsageError

Operation = Mapping[str, Any]
"""A request of a page: ``op`` and its arguments."""


LONGEST = 40
"""Maximum lines of a value between brackets whose layout is kept."""


def changed(text: str, change: Callable[[Any], None]) -> str:
    """Return the text after ``change`` of its data. Raises UsageError for invalid YAML."""
    yaml = _yaml(text)
    try:
        data = yaml.load(text)
    except YAMLError as error:
        raise UsageError("fix the text first: it is not valid YAML") from error
    if not isinstance(data, dict):
        raise UsageError("fix the text first: it is not a scenario")
    before = _written(yaml, data)
    change(data)
    after = _written(yaml, data)
    mended = _spliced(text, before, after)
    try:
        if yaml.load(mended) == yaml.load(after):
            return mended
    except YAMLError:
        pass
    return after


def parsed(text: str, *, flow: bool = True) -> Any:
    """Return the value of YAML text. ``flow``: write collections in flow style."""
    value = YAML(typ="rt").load(text)
    if flow and hasattr(value, "fa"):
        value.fa.set_flow_style()
    return value


def inline(value: Mapping[str, Any] | Sequence[Any]) -> Any:
    """Return a collection that is written on one line."""
    made = CommentedMap(value) if isinstance(value, Mapping) else CommentedSeq(value)
    made.fa.set_flow_style()
    return made


def _spliced(text: str, before: str, after: str) -> str:
    """Return ``text`` with the changes between ``before`` and ``after``, both written by the
    library. Unchanged lines keep their layout, even if the library would break them elsewhere."""
    old, new = before.splitlines(keepends=True), after.splitlines(keepends=True)
    bare = [_bare(line) for line in old]
    mine = list(_units(text.splitlines(keepends=True), frozenset(bare)))
    in_mine = _matches(bare, [_bare(line) for line in mine])
    in_new = _matches(old, new)
    found: list[str] = []
    base = at = at_new = 0
    for line in [i for i in range(len(old)) if i in in_mine and i in in_new] + [len(old)]:
        here, there = in_mine.get(line, len(mine)), in_new.get(line, len(new))
        found += _merged(old[base:line], mine[at:here], new[at_new:there])
        found += mine[here : here + 1]
        base, at, at_new = line + 1, here + 1, there + 1
    return "".join(found)


def _units(lines: list[str], known: frozenset[str]) -> Iterator[str]:
    """Yield the lines, joined where the library writes them as one."""
    index = 0
    while index < len(lines):
        joined, end = _bare(lines[index]), index + 1
        while joined not in known and end < min(len(lines), index + LONGEST):
            joined, end = joined + _bare(lines[end]), end + 1
        if joined not in known:
            end = index + 1
        yield "".join(lines[index:end])
        index = end


def _merged(old: list[str], mine: list[str], new: list[str]) -> list[str]:
    """Return the lines between two common lines: ``new`` if they were changed, else ``mine``, with
    lines that were only added before or after them."""
    if new[: len(old)] == old:
        return mine + new[len(old) :]
    if new[len(new) - len(old) :] == old:
        return new[: len(new) - len(old)] + mine
    return new


def _matches(old: list[str], new: list[str]) -> dict[int, int]:
    """Match each line of ``old`` to a line of ``new``."""
    blocks = SequenceMatcher(None, old, new, autojunk=False).get_matching_blocks()
    return {a + i: b + i for a, b, size in blocks for i in range(size)}


def _bare(line: str) -> str:
    return re.sub(r"\s+", "", line)


def _yaml(text: str) -> YAML:
    """Return a writer with the indentation of the text."""
    yaml = YAML(typ="rt")
    yaml.preserve_quotes = True
    yaml.width = 100_000
    step = re.search(r"^(?:map|robots)\s*:[ \t]*(?:#.*)?\n(?:\s*(?:#.*)?\n)*([ ]+)", text, re.M)
    dash = re.search(r"^obstacles\s*:[ \t]*(?:#.*)?\n(?:\s*#.*\n|\s*\n)*([ ]*)-", text, re.M)
    offset = len(dash[1]) if dash else 2
    yaml.indent(mapping=len(step[1]) if step else 2, sequence=offset + 2, offset=offset)
    return yaml


def _written(yaml: YAML, data: Any) -> str:
    out = io.StringIO()
    yaml.dump(data, out)
    return out.getvalue()


def put(holder: Any, key: str, value: Any, *, after: str) -> None:
    """Set the value of a key; a new key is inserted after another one."""
    if key in holder or after not in holder or not hasattr(holder, "insert"):
        holder[key] = value
    else:
        holder.insert(list(holder).index(after) + 1, key, value)
