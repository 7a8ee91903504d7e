"""Tests of the checker whose verdicts are theorems."""
