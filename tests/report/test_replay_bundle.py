"""The committed program of the page equals the build of its sources, is small and
self-contained."""

import hashlib
import json
import re
import shutil
from pathlib import Path

import pytest

from children import ran
from safenav.report.page.html import embedded, encoded, page_of
from safenav.run.run import Run

REPORT = Path(__file__).parents[2] / "safenav" / "report"
PAGE = REPORT / "page"
FRONT = PAGE / "front"
BUILT = sorted((PAGE / "assets").iterdir())


@pytest.mark.parametrize("built", BUILT, ids=lambda path: path.name)
def test_the_bundle_was_built_from_these_sources(built: Path) -> None:
    """Fails when sources changed without `npm run build` in safenav/report/page/front."""
    digest = hashlib.sha256()
    files = [path for path in (FRONT / "src").rglob("*") if path.is_file()]
    sources = sorted(path.relative_to(FRONT).as_posix() for path in files)
    for source in [*sources, "build.mjs", "package-lock.json", "tsconfig.json"]:
        digest.update(f"{source}\n".encode() + (FRONT / source).read_bytes())
    stamp = built.read_text().splitlines()[0]
    assert stamp == f"/* sources {digest.hexdigest()} */"


@pytest.mark.parametrize("check", ["build.mjs --check", "node_modules/.bin/tsc --noEmit"])
def test_a_rebuild_gives_the_same_bytes_and_types_are_right(check: str) -> None:
    node = shutil.which("node")
    if node is None or not (FRONT / "node_modules").exists():
        pytest.skip("needs Node and `npm ci` in safenav/report/page/front")
    done = ran([node, *check.split()], cwd=FRONT)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_page_is_small_and_names_no_other_file(replays: dict[str, Run]) -> None:
    page = page_of(replays["door"], "door.jsonl")
    assert re.findall(r'(?:src|href)="([^"]*)"', page) == ["data:,"]
    assert "default-src 'none'" in page
    assert len(page) <= 130_000


def test_a_set_of_regions_is_written_once(replays: dict[str, Run]) -> None:
    """With beliefs, pages of long runs took many megabytes."""
    data = encoded(replays["meeting"], "x.jsonl")
    changes = [change for robot in data["robots"] for change in robot["sight"]]
    assert len(changes) > len(data["sets"]) == len({*data["sets"]}) > 1


def test_embedded_data_survives_and_cannot_end_its_element() -> None:
    data = {"text": "</script><!-- \u2028 & > é", "number": [1, None, True]}
    text = embedded(data)
    assert not set("<>&\u2028") & set(text)
    assert json.loads(text) == data
