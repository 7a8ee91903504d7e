"""The content of the files that scenarios name, as short strings to compare by."""

from __future__ import annotations

import hashlib
from pathlib import Path

from safenav.batch.cases.case import Settings
from safenav.batch.cases.variation import varied
from safenav.scenario.yaml.document import DocumentError, Mapping, Node, Scalar, read_document
from safenav.scenario.yaml.findings import Findings
from safenav.scenario.yaml.source import read_bytes, read_source
from safenav.world.files.flaws import MAX_BYTES

_NAMING = ("map", "catalogue")


class References:
    """Reads each file once, however many cases there are."""

    def __init__(self) -> None:
        self._roots: dict[str, Node | None] = {}
        self._digests: dict[Path, str] = {}

    def of(self, scenario: Path, text: str, settings: Settings) -> str:
        """A digest of what the scenario names, with the settings in place; empty if nothing."""
        key = str(scenario)
        if key not in self._roots:
            self._roots[key] = _root_of(text)
        root = self._roots[key]
        if root is None:
            return ""
        naming = {path: value for path, value in settings.items() if path.split(".")[0] in _NAMING}
        if naming:
            root = varied(root, naming, Findings(str(scenario)))
        parts = [self._digest(path, root) for path in referenced_files(root, scenario.parent)]
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:16] if parts else ""

    def _digest(self, path: Path, named_at: Node) -> str:
        if path not in self._digests:
            data = read_bytes(path, Findings(str(path)), named_at, MAX_BYTES)
            self._digests[path] = "" if data is None else hashlib.sha256(data).hexdigest()
        return self._digests[path]


MAP_FILES = ("image", "ros", "movingai")


def referenced_files(root: Node, folder: Path) -> list[Path]:
    """The files that a scenario in ``folder`` names, whether they exist or not, each once."""
    found = [_file(_get(root, "catalogue"), folder)]
    world = _get(root, "map")
    found += [_file(_get(world, form), folder) for form in MAP_FILES]
    found.append(_file(_get(_get(world, "image"), "file"), folder))
    ros = _file(_get(world, "ros"), folder)
    if ros is not None:
        text = read_source(ros, Findings(str(ros)))
        found.append(_file(_get(_root_of(text or ""), "image"), ros.parent))
    return list(dict.fromkeys(path for path in found if path is not None))


def _get(node: Node | None, key: str) -> Node | None:
    return node.get(key) if isinstance(node, Mapping) else None


def _file(node: Node | None, folder: Path) -> Path | None:
    """A path if one stands there; a catalogue may as well be written in place."""
    return folder / node.value if isinstance(node, Scalar) and isinstance(node.value, str) else None


def _root_of(text: str) -> Node | None:
    try:
        return read_document(text).root
    except DocumentError:
        return None
