"""Warnings before a run; afterwards, the reasons of its failure, and repairs."""
