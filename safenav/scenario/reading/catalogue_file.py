"""The catalogue that a file gives: that of a scenario, or a catalogue file of its own."""

from __future__ import annotations

from pathlib import Path

from safenav.scenario.model import Catalogue
from safenav.scenario.reading.catalogue import CatalogueKeys, built_in, extended
from safenav.scenario.reading.loader import load_scenario_text
from safenav.scenario.reading.regions import RegionReader
from safenav.scenario.yaml.document import Mapping
from safenav.scenario.yaml.findings import Findings
from safenav.scenario.yaml.source import parsed, read_source


def catalogue_of(path: Path) -> Catalogue:
    """The built-in catalogue with what a scenario or a catalogue file adds.

    Raises InputError with every diagnostic if the file is neither.
    """
    findings = Findings(str(path))
    text = read_source(path, findings)
    document = None if text is None else parsed(text, findings)
    findings.raise_if_any()
    assert text is not None and document is not None
    root = document.root
    keys = {key.text for key, _ in root.entries} if isinstance(root, Mapping) else set()
    if not keys or not keys.issubset(CatalogueKeys.known):
        return load_scenario_text(text, str(path)).catalogue
    found = extended(built_in(), text, RegionReader(None, {}, findings), findings, str(path))
    findings.raise_if_any()
    return found
