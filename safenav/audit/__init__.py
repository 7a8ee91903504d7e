"""Reads traces and checks them, knowing nothing of the program that wrote them."""

from __future__ import annotations

from safenav.audit.check import Audit, audit, check_trace
from safenav.audit.reader import read_bytes, read_lines, read_trace
from safenav.audit.records import Trace
from safenav.audit.rule import Finding

__all__ = [
    "Audit",
    "Finding",
    "Trace",
    "audit",
    "check_trace",
    "read_bytes",
    "read_lines",
    "read_trace",
]
