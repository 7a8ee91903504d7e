"""The studio with its editor: a scenario's text, its drawing and its errors."""

from __future__ import annotations

import asyncio
import os
from itertools import count
from pathlib import Path, PurePosixPath
from typing import Any

from msgspec import Struct, field

from safenav.errors import InputError, UsageError
from safenav.files import another_kind, write_whole
from safenav.scenario.beginning import TEMPLATES, template_text
from safenav.scenario.reading.catalogue import built_in
from safenav.scenario.reading.loader import Draft, load_draft
from safenav.scenario.yaml.findings import MAX_BYTES, ReadableFolder
from safenav.studio.drawing import drawing_of, palette
from safenav.studio.editing import edited
from safenav.studio.process import RealizabilityQueue, RunOrder
from safenav.studio.session import Made, Message, ReplaceError, Studio

_ENDINGS = (".yaml", ".yml")
_DEEP = 3
"""Depth of the search, in folders."""
_SEEN = 3000
"""Folder entries after which the search ends: the folder may be a whole disk."""
_MOST = 300
_HEAD = 4096
"""Bytes of a file in which ``safenav:`` is searched."""


class ScenarioFolder(Struct, frozen=True):
    """Opens and saves the scenarios below ``folder``."""

    folder: Path

    def names(self) -> list[str]:
        """Return the scenario files below the folder, relative to it, the nearest first."""
        found: list[str] = []
        seen = 0
        for place, folders, files in os.walk(self.folder):
            depth = len(Path(place).relative_to(self.folder).parts)
            folders[:] = sorted(f for f in folders if not f.startswith(".") and depth + 1 < _DEEP)
            for name in sorted(files):
                path = Path(place) / name
                if path.suffix in _ENDINGS and not name.startswith(".") and _is_scenario(path):
                    found.append(path.relative_to(self.folder).as_posix())
            seen += len(folders) + len(files)
            if seen > _SEEN or len(found) >= _MOST:
                break
        return sorted(found[:_MOST], key=lambda name: (name.count("/"), name))

    def path(self, name: str) -> Path:
        """Return the file of that name. Raises UsageError for one outside the folder."""
        pure = PurePosixPath(name)
        hidden = any(part.startswith(".") for part in pure.parts)
        if pure.is_absolute() or hidden or pure.suffix not in _ENDINGS:
            raise UsageError(f"a name in {self.folder} is expected, such as lab.yaml")
        path = self.folder / pure
        if path.is_symlink() or not path.resolve().is_relative_to(self.folder.resolve()):
            raise UsageError(f"{name} is a link to a place outside {self.folder}")
        if not path.parent.is_dir():
            raise UsageError(f"no folder {path.parent}: create it, or choose another name")
        return path

    def name(self, path: Path) -> str:
        """Return a file's path relative to the folder, or its bare name if it is outside."""
        try:
            return path.resolve().relative_to(self.folder.resolve()).as_posix()
        except ValueError:
            return path.name


def read_text(path: Path) -> str:
    """Return the text of a scenario file. Raises UsageError if it cannot be read, or is of another
    kind, which saving would overwrite."""
    try:
        if path.stat().st_size > MAX_BYTES:
            raise UsageError(f"{path} is larger than {MAX_BYTES // 1_000_000} MB")
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"{path} cannot be read as text: {error}") from error
    if wrong := another_kind(text, "scenario", str(path)):
        raise UsageError("\n    ".join((f"{path}: {wrong[0]}", wrong[1])))
    return text


def save_text(path: Path, text: str, known: str | None, *, replace: bool) -> None:
    """Write a file whole or not at all. ``known``: the content that may be replaced.

    Raises ReplaceError if the file has another content, unless ``replace``.
    """
    if not replace and path.exists():
        try:
            there: str | None = path.read_text(encoding="utf-8-sig")
        except (OSError, UnicodeDecodeError):
            there = None
        if there is None or there != known:
            why = "already exists" if known is None else "has changed since it was opened"
            raise ReplaceError(f"{path.name} {why}")
    write_whole(path, lambda part: part.write_text(text, encoding="utf-8"))


def _is_scenario(path: Path) -> bool:
    if path.is_symlink() or not path.is_file():
        return False
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD)
    except OSError:
        return False
    return head.startswith(b"safenav:") or b"\nsafenav:" in head


class Editor(Studio):
    """Owner of the text. ``scenarios``: the folder in which scenarios are opened and saved;
    ``named``: the folder whose files a text may name, if the user named one."""

    def __init__(
        self, text: str, origin: TextOrigin, scenarios: ScenarioFolder, named: Path | None
    ) -> None:
        super().__init__(RunOrder(text, str(origin.file or "scenario.yaml")), built_in())
        self.scenarios = scenarios
        self.named = named
        self.document = OpenDocument(text, origin)
        self._drawn: TextOrigin | None = None
        self._realizability = RealizabilityQueue(self.tell)
        self._drawing: dict[str, Any] | None = None
        self._checking: asyncio.Task[None] | None = None
        self._checked = True
        self._draft = self._drafted()
        self._draw()
        self._does |= {
            "text": self._type,
            "edit": self._edit,
            "open": self._open,
            "files": self._files,
            "save": self._save,
        }

    @classmethod
    def of_file(cls, file: Path | None, folder: Path | None) -> Editor:
        """Return an editor of a file, or of a blank scenario. ``folder``: where scenarios are
        opened and saved; default: that of the file, else the current one. Raises UsageError for an
        unreadable file."""
        if file is not None and file.is_dir():
            file, folder = None, folder or file
        scenarios = ScenarioFolder(
            (folder or (Path.cwd() if file is None else file.parent)).resolve()
        )
        if file is not None and not file.parent.is_dir():
            raise UsageError(f"{file}: there is no folder {file.parent}")
        if file is None or not file.exists():
            text = blank()
            return cls(
                text, TextOrigin(file, saved=text if file is None else None), scenarios, folder
            )
        text = read_text(file)
        return cls(text, TextOrigin(file, saved=text), scenarios, folder)

    @property
    def title(self) -> str:
        return "safenav studio"

    async def close(self) -> None:
        await self._realizability.close()
        if self._checking is not None:
            self._checking.cancel()
        await super().close()

    def join(self, page: asyncio.Queue[str | None]) -> None:
        super().join(page)
        if not self._realizability.verdicts and self._draft.world is not None:
            self._realizability.check(self._order_of(self.document.text))

    async def made(self, name: str) -> Made | None:
        """Return a download: the scenario, or a result of the run."""
        file = self.document.origin.file
        stem = "scenario" if file is None else file.stem
        if name == "scenario":
            return f"{stem}.yaml", self.document.text.encode(), "application/yaml"
        return await super().made(name)

    def _everything(self) -> list[dict[str, Any]]:
        sent = super()._everything()
        return [*sent, self._view(), {"is": "verdicts", "verdicts": self._realizability.verdicts}]

    def _hello(self) -> dict[str, Any]:
        more = {"editor": True, "templates": TEMPLATES, "folder": str(self.scenarios.folder)}
        return {**super()._hello(), **more}

    def _view(self) -> dict[str, Any]:
        """Return the message with the text, its drawing, palette and errors."""
        document, file = self.document, self.document.origin.file
        return {
            "is": "document",
            "text": document.text,
            "revision": document.revision,
            "origin": document.origin.number,
            "dirty": document.dirty,
            "file": None if file is None else self.scenarios.name(file),
            "drawing": self._drawing,
            "palette": palette(self._draft.catalogue),
            "problems": [found._asdict() for found in self._draft.diagnostics],
        }

    def _reach(self) -> ReadableFolder:
        """Return the files that the text may name: those in the folder that the user named, else
        those in the folder of its file."""
        return ReadableFolder(self.named or Path(self._name).parent)

    @property
    def _name(self) -> str:
        """The assumed path of the text: files that it names are searched beside it."""
        return str(self.document.origin.file or self.scenarios.folder / "scenario.yaml")

    def _drafted(self, *, reachable: bool = True) -> Draft:
        return load_draft(self.document.text, self._name, self._reach(), reachable=reachable)

    def _order_of(self, text: str) -> RunOrder:
        return RunOrder(text, self._name, str(self._reach().folder))

    def _ordered(self) -> RunOrder:
        if not self._checked:
            self._draft, self._checked = self._drafted(), True
        if self._draft.scenario is None:
            raise InputError(self._draft.diagnostics)
        return self._order_of(self.document.text)

    def _draw(self) -> None:
        """Update the drawing. While the map is unreadable, the previous drawing of the same origin
        stays."""
        world = self._draft.world
        drawn = None
        if world is not None:
            drawn = drawing_of(self.document.text, world, self._draft.catalogue)
        kept = self._drawing if self._drawn is self.document.origin else None
        self._drawing, self._drawn = drawn or kept, self.document.origin
        self._catalogue = self._draft.catalogue

    def _changed(self) -> None:
        """Send the changed text to every page, and check it. The check that robots can reach their
        targets takes longer on large maps; its result is sent later."""
        self._draft, self._checked = self._drafted(reachable=False), False
        self._draw()
        self.tell(self._view())
        self.tell(self._hello())
        if self._checking is not None:
            self._checking.cancel()
        self._checking = asyncio.create_task(self._check(self.document.revision))
        hopeless = self._draft.world is None
        self._realizability.check(None if hopeless else self._order_of(self.document.text))

    async def _check(self, revision: int) -> None:
        await asyncio.sleep(0.1)
        draft = await asyncio.to_thread(self._drafted)
        if revision != self.document.revision:
            return
        self._draft, self._checked = draft, True
        self._draw()
        if draft.diagnostics:
            self.tell(self._view())

    async def _type(self, data: Message) -> None:
        text = data.get("text")
        if not isinstance(text, str) or len(text) > MAX_BYTES:
            raise UsageError("a text is expected, of at most 5 MB")
        if self.document.change(text):
            self._changed()

    async def _edit(self, data: Message) -> None:
        if self.document.change(edited(self.document.text, data, self._draft.world)):
            self._changed()

    async def _open(self, data: Message) -> None:
        """Open another text: ``kind`` blank, template or file."""
        kind = data.get("kind")
        if kind == "blank":
            rows, cols = data.get("rows") or 9, data.get("cols") or 15
            if not isinstance(rows, int) or not isinstance(cols, int):
                raise UsageError("expected numbers of rows and columns")
            self._begin_with(blank(rows, cols))
        elif kind == "template":
            self._begin_with(template(str(data.get("name"))))
        elif kind == "file":
            path = self.scenarios.path(str(data.get("name")))
            text = await asyncio.to_thread(read_text, path)
            self.document.change(text, origin=TextOrigin(path, saved=text))
            self._changed()
        else:
            raise UsageError("unknown beginning; known: blank, template, file")

    def _begin_with(self, text: str) -> None:
        """Open a text without a file; a named file that does not exist yet stays its target."""
        file = self.document.origin.file
        new = file if file is not None and not file.exists() else None
        self.document.change(text, origin=TextOrigin(new, None if new else text))
        self._changed()

    async def _files(self, _: Message) -> None:
        """Send the names of the scenarios that can be opened."""
        self.tell({"is": "files", "names": await asyncio.to_thread(self.scenarios.names)})

    async def _save(self, data: Message) -> None:
        """Save the text to its file, or under a ``name`` in the folder. A file with unknown content
        is replaced only if ``replace`` is set."""
        name, document = data.get("name"), self.document
        origin = document.origin
        path = self.scenarios.path(name) if isinstance(name, str) and name else origin.file
        if path is None:
            raise UsageError("the scenario has no name yet: Save as gives it one")
        known = origin.saved if path == origin.file else None
        save_text(path, document.text, known, replace=data.get("replace") is True)
        moved = path != origin.file
        origin.file, origin.saved = path, document.text
        self.tell({"is": "saved", "file": self.scenarios.name(path)})
        if moved:  # the text may now name other files
            self._changed()
        else:
            self.tell(self._view())


class TextOrigin(Struct, eq=False):
    """The origin of a text. ``file``: the file that it is saved to, if any; ``saved``: the content
    of the file, or the initial text, which needs no saving; ``number``: distinguishes origins."""

    file: Path | None = None
    saved: str | None = None
    number: int = field(default_factory=count().__next__)


class OpenDocument(Struct):
    """Owner of the text. ``revision`` grows with every change; pages keep the history."""

    text: str
    origin: TextOrigin = field(default_factory=TextOrigin)
    revision: int = 0

    @property
    def dirty(self) -> bool:
        return self.text != self.origin.saved

    def change(self, text: str, origin: TextOrigin | None = None) -> bool:
        """Replace the text, and its ``origin`` if one is given; return whether anything changed."""
        if text == self.text and origin is None:
            return False
        self.text, self.origin = text, origin or self.origin
        self.revision += 1
        return True


BLANK = """\
safenav: 1
name: new scenario
map:
  grid: |
{grid}
robots: {{}}
until: {{rounds: 2}}
limits: {{ticks: 500}}
"""


def blank(rows: int = 9, cols: int = 15) -> str:
    """Return a scenario of one walled room without robots. Raises UsageError for its size."""
    if not (3 <= rows <= 512 and 3 <= cols <= 512):
        raise UsageError("a blank map has 3 to 512 rows and columns")
    inner = "#" + "." * (cols - 2) + "#"
    lines = ["#" * cols, *[inner] * (rows - 2), "#" * cols]
    return BLANK.format(grid="\n".join(f"    {line}" for line in lines))


def template(name: str) -> str:
    """Return a template by its name. Raises UsageError for an unknown one."""
    if name not in TEMPLATES:
        raise UsageError(f"there is no template '{name[:40]}'; known: {', '.join(TEMPLATES)}")
    return template_text(name)
