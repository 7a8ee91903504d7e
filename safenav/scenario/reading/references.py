"""Which other files a scenario is made of: its catalogue, its map, the image of that map."""

from __future__ import annotations

from pathlib import Path

from safenav.scenario.yaml.document import DocumentError, Mapping, Node, Scalar, read_document
from safenav.scenario.yaml.findings import Findings
from safenav.scenario.yaml.source import read_source

MAP_FILES = ("image", "ros", "movingai")


def referenced_files(root: Node, folder: Path) -> list[Path]:
    """The files that a scenario in ``folder`` names, whether they exist or not, each once."""
    found = [_file(_get(root, "catalogue"), folder)]
    world = _get(root, "map")
    found += [_file(_get(world, form), folder) for form in MAP_FILES]
    found.append(_file(_get(_get(world, "image"), "file"), folder))
    ros = _file(_get(world, "ros"), folder)
    if ros is not None:
        found.append(_file(_get(_root(ros), "image"), ros.parent))
    return list(dict.fromkeys(path for path in found if path is not None))


def _get(node: Node | None, key: str) -> Node | None:
    return node.get(key) if isinstance(node, Mapping) else None


def _file(node: Node | None, folder: Path) -> Path | None:
    """A path if one stands there; a catalogue may as well be written in place."""
    return folder / node.value if isinstance(node, Scalar) and isinstance(node.value, str) else None


def _root(path: Path) -> Node | None:
    text = read_source(path, Findings(str(path)))
    try:
        return None if text is None else read_document(text).root
    except DocumentError:
        return None
