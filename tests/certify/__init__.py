"""The producer of bundles and their checker, judged by oracles, mutations and planted errors."""
