"""The content of the files that scenarios name, as short strings to compare by."""

from __future__ import annotations

import hashlib
from pathlib import Path

from safenav.batch.cases.case import Settings
from safenav.batch.cases.variation import varied
from safenav.scenario.reading.references import referenced_files
from safenav.scenario.yaml.document import DocumentError, Node, read_document
from safenav.scenario.yaml.findings import Findings
from safenav.scenario.yaml.source import read_bytes
from safenav.world.files.flaws import MAX_BYTES

_NAMING = ("map", "catalogue")


class References:
    """Reads each file once, however many cases there are."""

    def __init__(self) -> None:
        self._roots: dict[str, Node | None] = {}
        self._digests: dict[Path, str] = {}

    def of(self, scenario: Path, text: str, settings: Settings) -> str:
        """A digest of what the scenario names, with the settings in place; empty if nothing."""
        root = self._root(scenario, text)
        if root is None:
            return ""
        naming = {path: value for path, value in settings.items() if _is_naming(path)}
        if naming:
            root = varied(root, naming, Findings(str(scenario)))
        parts = [self._digest(path, root) for path in referenced_files(root, scenario.parent)]
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:16] if parts else ""

    def _root(self, scenario: Path, text: str) -> Node | None:
        key = str(scenario)
        if key not in self._roots:
            try:
                self._roots[key] = read_document(text).root
            except DocumentError:
                self._roots[key] = None
        return self._roots[key]

    def _digest(self, path: Path, named_at: Node) -> str:
        if path not in self._digests:
            data = read_bytes(path, Findings(str(path)), named_at, MAX_BYTES)
            self._digests[path] = "" if data is None else hashlib.sha256(data).hexdigest()
        return self._digests[path]


def _is_naming(setting: str) -> bool:
    return setting.split(".")[0] in _NAMING
