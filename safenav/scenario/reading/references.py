"""The files that a scenario names: those of its map, in any form, and its catalogue."""

from __future__ import annotations

from pathlib import Path

from safenav.scenario.yaml.document import DocumentError, Node, Scalar, below, read_document
from safenav.scenario.yaml.findings import Findings
from safenav.scenario.yaml.source import read_source

_PLACES = (
    ("catalogue",),
    ("map", "image"),
    ("map", "image", "file"),
    ("map", "ros"),
    ("map", "movingai"),
)


def referenced_files(root: Node | None, folder: Path) -> list[Path]:
    """Return the files that a scenario in ``folder`` names, existing or not, each once."""
    found = [_file(below(root, *keys), folder) for keys in _PLACES]
    ros = _file(below(root, "map", "ros"), folder)
    if ros is not None:
        text = read_source(ros, Findings(str(ros)))
        found.append(_file(below(root_of(text or ""), "image"), ros.parent))
    return list(dict.fromkeys(path for path in found if path is not None))


def root_of(text: str) -> Node | None:
    """Return the YAML document in a text; None if it is not valid."""
    try:
        return read_document(text).root
    except DocumentError:
        return None


def _file(node: Node | None, folder: Path) -> Path | None:
    """Return the path in a node; None if it is not text, such as a catalogue in place."""
    return folder / node.value if isinstance(node, Scalar) and isinstance(node.value, str) else None
