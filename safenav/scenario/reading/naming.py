"""The forms of names in scenarios."""

import re

from safenav.scenario.yaml.document import Scalar, clipped
from safenav.scenario.yaml.findings import Findings

NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_-]*")
IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
"""The form of names that become variables of specifications."""


def well_named(key: Scalar, what: str, findings: Findings, form: re.Pattern[str] = NAME) -> bool:
    """Return whether a key can name ``what``; report it if not."""
    if form.fullmatch(key.text):
        return True
    signs = "digits, '_' and '-'" if form is NAME else "digits and '_'"
    hint = f"use letters from a to z, {signs}, beginning with a letter"
    if not key.text.isascii():
        hint += ": specifications are ASCII; 'name' of the scenario may be any text"
    findings.add(key, f"'{clipped(key.text)}' cannot name {what}", hint)
    return False
