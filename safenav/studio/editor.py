"""The studio with its editor: a scenario's text, drawing and errors."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from itertools import count
from pathlib import Path, PurePosixPath
from typing import Any

from msgspec import Struct, field

from safenav.errors import REPORTED, InputError, UsageError
from safenav.files import check_kind, decoded, kind_of, read_input, write_whole
from safenav.scenario.beginning import TEMPLATES, template_text
from safenav.scenario.reading.catalogue import built_in
from safenav.scenario.reading.loader import load_draft
from safenav.scenario.yaml.findings import MAX_BYTES
from safenav.studio.drawing import drawing_of, palette
from safenav.studio.editing import edited
from safenav.studio.process import RealizabilityQueue, RunOrder
from safenav.studio.session import Made, Message, Page, ReplaceError, Studio

_ENDINGS = (".yaml", ".yml")
_DEEP = 3
"""Depth of the search for scenarios, in folders."""
_MOST = 300
_HEAD = 4096
"""Initial bytes of a file that are searched for ``safenav:``."""


class ScenarioFolder(Struct, frozen=True):
    """The scenarios below ``folder``, which users can open and save."""

    folder: Path

    def names(self) -> list[str]:
        """Return the scenario files below the folder, relative to it, nearest first."""
        found: list[str] = []
        for depth in range(_DEEP):
            for path in sorted(filter(Path.is_file, self.folder.glob("*/" * depth + "*.y*ml"))):
                name = path.relative_to(self.folder).as_posix()
                with suppress(UsageError, OSError), self.path(name).open("rb") as file:
                    if kind_of(file.read(_HEAD).decode(errors="replace")) == "scenario":
                        found.append(name)
        return found[:_MOST]

    def path(self, name: str) -> Path:
        """Return the path of a file by its name. Raises UsageError if it is not in the folder."""
        pure = PurePosixPath(name)
        hidden = any(part.startswith(".") for part in pure.parts)
        if pure.is_absolute() or hidden or pure.suffix not in _ENDINGS:
            raise UsageError(f"expected a name in {self.folder}, such as lab.yaml")
        path = self.folder / pure
        if path.is_symlink() or not path.resolve().is_relative_to(self.folder.resolve()):
            raise UsageError(f"{name} is a link, or leads outside {self.folder}")
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
    """Return the text of a scenario file. Raises InputError if it cannot be read, or is of another
    kind and must not be overwritten."""
    text = decoded(read_input(path, MAX_BYTES, named=True), str(path))
    check_kind(text, "scenario", str(path))
    return text


def save_text(path: Path, text: str, known: str | None, *, replace: bool) -> None:
    """Write a whole file or nothing. ``known``: the content that may be replaced.

    Raises ReplaceError if the file has another content, unless ``replace``.
    """
    if not replace and path.exists() and decoded(path.read_bytes(), str(path)) != known:
        why = "already exists" if known is None else "has changed since it was opened"
        raise ReplaceError(f"{path.name} {why}")
    write_whole(path, lambda part: part.write_text(text, encoding="utf-8"))


class TextOrigin(Struct, eq=False):
    """The origin of a text. ``file``: the file for saving it, if any; ``saved``: the file's
    content, or the initial text, which needs no save; ``number``: distinguishes origins."""

    file: Path | None = None
    saved: str | None = None
    number: int = field(default_factory=count().__next__)


class Editor(Studio):
    """The owner of the ``text``. ``revision`` grows with every change; pages keep the history.
    ``scenarios``: the folder for opening and saving scenarios; ``named``: the folder whose files
    the text may name, if the user has given one."""

    def __init__(
        self, text: str, origin: TextOrigin, scenarios: ScenarioFolder, named: Path | None
    ) -> None:
        super().__init__(RunOrder(text, str(origin.file or "scenario.yaml")), built_in())
        self.scenarios = scenarios
        self.named = named
        self.text = text
        self.origin = origin
        self.revision = 0
        self._realizability = RealizabilityQueue(self.tell)
        self._drawing: dict[str, Any] | None = None
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
        """Return an editor of a file or of a blank scenario. ``folder``: the folder for opening and
        saving scenarios; default: that of the file, else the current one. Raises InputError for an
        unreadable file."""
        if file is not None and file.is_dir():
            file, folder = None, folder or file
        place = folder or (Path.cwd() if file is None else file.parent)
        if file is not None and not file.parent.is_dir():
            raise UsageError(f"{file}: there is no folder {file.parent}")
        there = file is not None and file.exists()
        text = read_text(file) if file is not None and there else blank()
        origin = TextOrigin(file, saved=text if file is None or there else None)
        return cls(text, origin, ScenarioFolder(place.resolve()), folder)

    @property
    def title(self) -> str:
        return "safenav studio"

    async def close(self) -> None:
        await self._realizability.close()
        await super().close()

    def join(self, page: Page) -> None:
        super().join(page)
        if not self._realizability.verdicts and self._draft.world is not None:
            self._realizability.check(self._order)

    async def made(self, name: str) -> Made | None:
        """Return the download with this name: the scenario's text or a file made from the run."""
        if name == "scenario":
            stem = "scenario" if self.origin.file is None else self.origin.file.stem
            return f"{stem}.yaml", self.text.encode(), "application/yaml"
        return await super().made(name)

    def _everything(self) -> list[dict[str, Any]]:
        sent = super()._everything()
        return [*sent, self._view(), {"is": "verdicts", "verdicts": self._realizability.verdicts}]

    def _hello(self) -> dict[str, Any]:
        more = {"editor": True, "templates": TEMPLATES, "folder": str(self.scenarios.folder)}
        return {**super()._hello(), **more}

    def _view(self) -> dict[str, Any]:
        """Return a message for pages: the text, its drawing and errors, and the palette."""
        file = self.origin.file
        return {
            "is": "document",
            "text": self.text,
            "revision": self.revision,
            "origin": self.origin.number,
            "dirty": self.text != self.origin.saved,
            "file": None if file is None else self.scenarios.name(file),
            "drawing": self._drawing,
            "palette": palette(self._draft.catalogue),
            "problems": [found._asdict() for found in self._draft.diagnostics[:REPORTED]],
        }

    def _ordered(self) -> RunOrder:
        if self._draft.scenario is None:
            raise InputError(self._draft.diagnostics)
        return self._order

    def _draw(self) -> None:
        """Read the text and draw it. While the map is unreadable, the previous drawing stays. The
        check of reachable targets follows later, with the strategies. The text may name files in
        the folder that the user has given, or else in its own folder."""
        file = self.origin.file or self.scenarios.folder / "scenario.yaml"
        order = RunOrder(self.text, str(file), str(self.named or file.parent))
        self._draft = load_draft(order.text, order.file, order.reach, reachable=False)
        self._order, self._catalogue = order, self._draft.catalogue
        if self._draft.world is not None:
            self._drawing = drawing_of(
                self.text, Path(order.file).stem, self._draft.world, self._catalogue
            )

    def _replace(self, text: str, origin: TextOrigin | None = None) -> None:
        """Replace the text (and its ``origin``, if given), send it to every page, and check it."""
        if text == self.text and origin is None:
            return
        if origin is not None:
            self.origin, self._drawing = origin, None
        self.text = text
        self.revision += 1
        self._draw()
        self.tell(self._view())
        self._realizability.check(None if self._draft.world is None else self._order)

    async def _type(self, data: Message) -> None:
        text = data.get("text")
        if not isinstance(text, str) or len(text) > MAX_BYTES:
            raise UsageError("expected a text of at most 5 MB")
        self._replace(text)

    async def _edit(self, data: Message) -> None:
        self._replace(edited(self.text, data, self._draft.world))

    async def _open(self, data: Message) -> None:
        """Open another text: ``kind`` blank, template or file. A blank text or template will be
        saved to the named file if that does not exist yet."""
        kind, name = data.get("kind"), str(data.get("name"))
        if kind == "file":
            path = self.scenarios.path(name)
            text = await asyncio.to_thread(read_text, path)
            return self._replace(text, TextOrigin(path, saved=text))
        if kind == "template":
            if name not in TEMPLATES:
                raise UsageError(f"there is no template '{name[:40]}'")
            text = template_text(name)
        else:
            text = blank(data.get("rows", 9), data.get("cols", 15))
        file = self.origin.file
        new = file if file is not None and not file.exists() else None
        return self._replace(text, TextOrigin(new, None if new else text))

    async def _files(self, _: Message) -> None:
        """Send the names of the available scenarios to all pages."""
        self.tell({"is": "files", "names": await asyncio.to_thread(self.scenarios.names)})

    async def _save(self, data: Message) -> None:
        """Save the text to its file or under a ``name`` in the folder. Replace a file with unknown
        content only if ``replace`` is set."""
        name, origin = data.get("name"), self.origin
        path = self.scenarios.path(name) if isinstance(name, str) and name else origin.file
        if path is None:
            raise UsageError("the scenario has no name yet: use 'Save as'")
        known = origin.saved if path == origin.file else None
        save_text(path, self.text, known, replace=data.get("replace") is True)
        moved = path != origin.file
        origin.file, origin.saved = path, self.text
        self.tell({"is": "saved", "file": self.scenarios.name(path)})
        if moved:  # the text may now name other files
            self._replace(self.text, origin)
        else:
            self.tell(self._view())


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


def blank(rows: Any = 9, cols: Any = 15) -> str:
    """Return a scenario of one walled room without robots. Raises UsageError for a size out of
    range."""
    if not all(isinstance(size, int) and 3 <= size <= 512 for size in (rows, cols)):
        raise UsageError("a blank map has 3 to 512 rows and columns")
    inner = "#" + "." * (cols - 2) + "#"
    lines = ["#" * cols, *[inner] * (rows - 2), "#" * cols]
    return BLANK.format(grid="\n".join(f"    {line}" for line in lines))
