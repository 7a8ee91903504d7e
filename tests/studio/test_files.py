"""The studio reads and writes the files that it was given, and no others."""

import asyncio
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from safenav.errors import UsageError
from safenav.studio.editor import Editor
from studio.serving import Page, Served, visit


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("home")
    (found / "lab").mkdir()
    (found / "secret.yaml").write_text("somebody else's\n")
    return found


@pytest.fixture(scope="module")
def served(home: Path) -> Iterator[Served]:
    with Served("studio", home / "mine.yaml", "--folder", home / "lab", "--no-browser") as found:
        yield found


def is_document(message: dict[str, Any]) -> bool:
    return message["is"] == "document"


@pytest.mark.parametrize(
    "name",
    [
        *("../out.yaml", "/tmp/out.yaml", "sub/out.yaml", ".hidden.yaml", "out.py", "link.yaml"),
        f"{'n' * 5000}.yaml",
    ],
    ids=lambda name: name[:12],
)
def test_nothing_is_written_outside_the_folder(served: Served, home: Path, name: str) -> None:
    before = (home / "secret.yaml").read_text()
    if not (home / "lab" / "link.yaml").is_symlink():
        (home / "lab" / "link.yaml").symlink_to(home / "secret.yaml")

    async def story(page: Page) -> None:
        for kind, what in (("save", {}), ("open", {"kind": "file"})):
            await page.say(kind, name=name, **what)
            refused = await page.hear(lambda m: m["is"] == "refused")
            assert len(name) < 50 or "too long" in refused["message"]

    visit(served.address, story)
    assert not (home / "out.yaml").exists()
    assert (home / "secret.yaml").read_text() == before


def test_a_name_in_the_folder_is_written_whole(served: Served, home: Path) -> None:
    async def story(page: Page) -> None:
        await page.say("open", kind="template", name="door")
        told = await page.hear(lambda m: is_document(m) and "a door on the way" in m["text"])
        await page.say("save", name="door.yaml")
        await page.hear(lambda m: m["is"] == "saved")
        assert (home / "lab" / "door.yaml").read_text() == told["text"]

    visit(served.address, story)


def test_two_editors_of_one_text_agree(served: Served) -> None:
    from studio.serving import opened

    async def main() -> None:
        async with opened(served.address) as one, opened(served.address) as other:
            await one.say("open", kind="blank", rows=5, cols=6)
            await other.hear(lambda m: is_document(m) and "    ######\n" in m["text"])
            await other.say("edit", op="paint", regions=[8], wall=True)
            told = await one.hear(lambda m: is_document(m) and "    #.#..#" in m["text"])
            again = await other.hear(lambda m: is_document(m) and "    #.#..#" in m["text"])
            assert (told["text"], told["revision"]) == (again["text"], again["revision"])

    asyncio.run(main())


def test_a_trace_is_not_opened_as_a_scenario(tmp_path: Path) -> None:
    trace = tmp_path / "run.jsonl"
    trace.write_text('{"type":"header","trace":2,"safenav":"0","scenario":{}}\n')
    with pytest.raises(UsageError, match="this is a trace, not a scenario"):
        Editor.of_file(trace, None)


@pytest.mark.parametrize("named", ["flat", "flat/flat.yaml"])
def test_a_map_is_read_from_the_folder_and_from_nowhere_else(named: str, tmp_path: Path) -> None:
    flat = "P2 4 4 255\n0 0 0 0\n0 255 255 0\n0 255 255 0\n0 0 0 0\n"
    text = "safenav: 1\nmap: {image: IMAGE, rows: 4, cols: 4}\n"
    text += "robots: {eye: {model: quadcopter, start: [1, 1], objective: {hold: [1, 1]}}}\n"
    (tmp_path / "flat").mkdir()
    (tmp_path / "flat" / "floor.pgm").write_text(flat)
    (tmp_path / "flat" / "flat.yaml").write_text(text.replace("IMAGE", "floor.pgm"))
    (tmp_path / "flat" / "out.yaml").write_text(text.replace("IMAGE", "../floor.pgm"))

    async def story(page: Page) -> None:
        await page.say("open", kind="file", name="flat.yaml")
        told = await page.hear(lambda m: is_document(m) and m["file"] == "flat.yaml")
        assert told["drawing"]["run"]["rows"] == 4 and not told["problems"]
        await page.say("open", kind="file", name="out.yaml")
        told = await page.hear(lambda m: is_document(m) and m["file"] == "out.yaml")
        assert told["drawing"] is None, "the map before is not that of this one"
        (problem,) = told["problems"]
        assert "outside the folder" in problem["found"] and "--folder" in problem["hint"]

    with Served("studio", tmp_path / named, "--no-browser") as served:
        visit(served.address, story)
