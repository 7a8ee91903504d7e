"""Files that an enemy wrote: traces, bundles, and all others that commands read."""
