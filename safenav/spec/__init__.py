"""From a robot and its objective to a GR(1) specification in structured slugs."""
