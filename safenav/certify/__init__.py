"""Runs with their proofs: progress measures, bundles and the page of a bundle."""
