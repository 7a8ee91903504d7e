"""Pictures: SVG, PNG, GIF."""
