"""Bundles are checked in this process when they are made."""

from certify.conftest import checked_here

__all__ = ["checked_here"]
