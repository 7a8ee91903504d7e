"""YAML that is changed in its values alone: comments, order and spacing stay as they were.

ruamel.yaml keeps comments and order, but writes in a spacing of its own. So what it writes before
and after a change is compared, and only the lines that differ are put into the text.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Mapping
from difflib import SequenceMatcher
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError

from safenav.errors import UsageError

Operation = Mapping[str, Any]
"""A request of a page: ``op`` and its arguments."""


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
        if mended is not None and yaml.load(mended) == yaml.load(after):
            return mended
    except YAMLError:
        pass
    return after


def parsed(text: str) -> Any:
    """A value as it would stand in a scenario, in flow style where it is a collection."""
    value = YAML(typ="rt").load(text)
    if hasattr(value, "fa"):
        value.fa.set_flow_style()
    return value


def _spliced(text: str, before: str, after: str) -> str | None:
    """``text`` with the lines in which ``after`` differs from ``before``; None if the lines of
    ``text`` and ``before`` are not the same but for blanks."""
    mine, old, new = (part.splitlines(keepends=True) for part in (text, before, after))
    if [_bare(line) for line in mine] != [_bare(line) for line in old]:
        return None
    found: list[str] = []
    for tag, a, b, c, d in SequenceMatcher(None, old, new, autojunk=False).get_opcodes():
        found += mine[a:b] if tag == "equal" else new[c:d]
    return "".join(found)


def _bare(line: str) -> str:
    return re.sub(r"\s+", "", line)


def _yaml(text: str) -> YAML:
    """Writes with the indentation that the text has."""
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
    """A value under a key; a new one stands behind another key."""
    if key in holder or after not in holder or not hasattr(holder, "insert"):
        holder[key] = value
    else:
        holder.insert(list(holder).index(after) + 1, key, value)
