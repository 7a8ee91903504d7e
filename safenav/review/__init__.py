"""Warnings before a run, and the reasons of its failure and repairs after it."""
