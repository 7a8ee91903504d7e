"""Pictures: SVG, PNG and GIF."""
