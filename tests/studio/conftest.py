"""A house to draw in."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from report.browser import Browser
from studio.board import HOUSE, Board
from studio.serving import Served


@pytest.fixture
def house(browser: Browser, tmp_path: Path) -> Iterator[Board]:
    (tmp_path / "house.yaml").write_text(HOUSE)
    with Served("studio", tmp_path / "house.yaml", "--no-browser") as served:
        yield Board(browser, served.address, cols=9)
