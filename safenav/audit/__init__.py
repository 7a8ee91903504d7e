"""Reads traces and checks them, knowing nothing of the program that wrote them."""

from __future__ import annotations

from safenav.audit.reader import read_bytes, read_lines, read_trace
from safenav.audit.records import Trace

__all__ = ["Trace", "read_bytes", "read_lines", "read_trace"]
