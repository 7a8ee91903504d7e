"""Pictures in pixels, with a warning about characters that no font has."""

from __future__ import annotations

from safenav.cli import warn


def pixels_of(picture: str, width: int | None) -> bytes:
    """Return a vector picture in pixels. Raises UsageError without the extra ``pictures``."""
    from safenav.report.picture.raster import png_of

    pixels = png_of(picture, width)
    warn_of_boxes(picture)
    return pixels


def warn_of_boxes(picture: str) -> None:
    """Warn about characters of a vector picture that its pixels show as boxes."""
    from safenav.report.picture.raster import lacking

    if letters := lacking(picture):
        shown = letters if len(letters) <= 10 else f"{letters[:10]}..."
        warn(
            f"no font on this machine has {shown}: boxes take their place",
            "    install a font for them (Debian: fonts-noto-cjk, fonts-symbola), or write SVG",
        )
