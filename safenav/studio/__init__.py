"""The studio: a local web page in which to draw a scenario and watch its run."""
