"""The program that checks bundles; it knows nothing of safenav and goes into each bundle."""

import sys

from safenav.certify.checker import check_strategies

# One half imports the other by this name, as it does in a bundle.
sys.modules.setdefault("check_strategies", check_strategies)
