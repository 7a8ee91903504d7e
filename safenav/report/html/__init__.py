"""The replay as one self-contained HTML page: ``page_of``."""

from safenav.report.html.page import page_of

__all__ = ["page_of"]
