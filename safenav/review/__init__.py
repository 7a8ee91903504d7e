"""Warnings before a run; the reasons of its failure and repairs after it."""
