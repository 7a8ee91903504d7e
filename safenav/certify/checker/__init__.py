"""The program that checks bundles; it knows nothing of safenav and goes into each bundle."""
