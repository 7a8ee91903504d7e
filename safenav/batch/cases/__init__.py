"""What a batch runs: cases, where they come from, how they vary."""
