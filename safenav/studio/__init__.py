"""The studio: a local web page for drawing scenarios and watching their runs."""
