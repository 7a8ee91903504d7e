"""Many scenarios: find them, run them side by side, compare each with what it expects."""
