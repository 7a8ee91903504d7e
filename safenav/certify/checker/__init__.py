"""The program that checks bundles; it is independent of safenav and goes into each bundle."""
