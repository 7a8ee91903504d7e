"""A run with its proof: progress measures, bundles, and the page of a bundle."""
