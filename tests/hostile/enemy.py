"""Traces and bundles with hostile names, numbers, sizes, keys and nesting, made of honest ones."""

import hashlib
import json
import tempfile
import zipfile
from collections.abc import Callable
from copy import deepcopy
from pathlib import Path
from random import Random
from typing import Any

from certify.making import Files, rewrite
from hostile.attack import MARK

Lines = list[Any]
RUN = "__import__('pathlib').Path({0!r}).touch()"
CODE = (
    *(RUN, "x: 0, " + RUN + ", lambda y", "0) or " + RUN + " or (0", "{{{{" + RUN + "}}}}"),
    *("!!python/object/apply:os.system ['touch {0}']", "$(touch {0})", "`touch {0}`"),
    *("; touch {0}", "a' or " + RUN + " or '", "next(" + RUN + ")", "%n%s{0}"),
    "cos\nsystem\n(S'touch {0}'\ntR.",
)
WORDS = (
    *("", " ", ".", "..", "../../../{0}", "/etc/passwd", "{0}", "__class__", "__proto__", "from_"),
    *("line", "data", "either", "any robot", "robots.b", "obstacles.door@9", "region", "heading"),
    *("TRUE", "None", "NaN", "-rf", "a\nb", "a\x00b", "\x1b[31m{0}", "\u202e{0}", "\ud800", "é"),
    *("<script>{0}</script>", '"><img src=x>', "{{0.__class__}}", "%s%n%x", "a" * 300, "b" * 10**5),
)
NUMBERS = (
    *("-1", "0", "1", "true", "false", "null", '"7"', "0.5", "-0.0", "1e308", "1e400", "-1e400"),
    *("NaN", "Infinity", "-Infinity", "2147483648", "9007199254740992", "9223372036854775808"),
    *("1000000000", "1000000000000000", "9" * 400, "9" * 5000, "1e-320", "[]", "{}", "01"),
)
DEPTHS = (5, 60, 190, 300, 900, 5000, 200_000)


class Enemy:
    """Makes one hostile file after another. ``canary``: a file that no reader may make."""

    def __init__(self, seed: int, canary: Path) -> None:
        self.rng, self.canary = Random(seed), str(canary)
        self.raw: dict[str, str] = {}
        """Raw text by the name of the hole in the data where it goes in."""

    def word(self) -> str:
        """A hostile word that is no legal name."""
        word = self.rng.choice(CODE if self.rng.random() < 0.5 else WORDS)
        word = word.replace("{0!r}", repr(self.canary)).replace("{0}", self.canary)
        return word if self.rng.random() < 0.3 else f"{word} {MARK}"

    def lines(self, lines: Lines) -> bytes:
        """The text of a hostile trace."""
        lines, self.raw = deepcopy(lines), {}
        often, seldom = (self._swap, self._name, self._number), (self._size, self._key, self._nest)
        for _ in range(self.rng.choice((1, 1, 1, 2, 3))):
            self.rng.choice(often * 2 + seldom)(lines)
        text = "\n".join([*map(self._text, lines), ""]).encode("utf-8", "surrogatepass")
        at = self.rng.randrange(len(text))
        bytes_ = {
            0: b"\xef\xbb\xbf" + text,
            1: text.replace(b"\n", b"\r\n"),
            2: text[:at] + self.rng.randbytes(3) + text[at:],
            3: text[:at],
        }
        return bytes_.get(self.rng.randrange(40), text)

    def bundle(self, files: Files) -> Files:
        """The files of a hostile bundle."""
        others = [name for name in files if name.startswith(("strategies/", "proofs/"))]
        name = self.rng.choice(["trace.jsonl"] * max(1, len(others)) + others)
        if name == "trace.jsonl":
            return files | {
                name: self.lines([json.loads(line) for line in files[name].split(b"\n") if line])
            }
        try:
            data = self.lines([json.loads(files[name])])
        except ValueError:
            data = self._formulas(files[name].decode())
        old, new = Path(name).stem, hashlib.sha256(data).hexdigest()
        if name.startswith("strategies/") and self.rng.random() < 0.8:
            trace = files["trace.jsonl"].replace(old.encode(), new.encode())
            files = {key.replace(old, new): value for key, value in files.items()}
            return files | {name.replace(old, new): data, "trace.jsonl": trace}
        return files | {name: data}

    def _places(self, lines: Lines) -> list[tuple[Any, Any]]:
        """All containers with a key or an index in them."""
        found, left = [], [*lines]
        while left:
            one = left.pop()
            for key, value in one.items() if isinstance(one, dict) else enumerate(one):
                found.append((one, key))
                if isinstance(value, dict | list):
                    left.append(value)
        return found

    def _place(self, lines: Lines, wanted: Callable[[Any], bool]) -> tuple[Any, Any]:
        """One of the places whose value is wanted: of the header as often as of all lines."""
        part = lines[:1] if self.rng.random() < 0.5 else lines
        places = [(one, key) for one, key in self._places(part) if wanted(one[key])]
        return self.rng.choice(places or self._places(lines))

    def _hole(self, text: str) -> str:
        hole = f"\x02hole\x02{len(self.raw)}"
        self.raw[hole] = text
        return hole

    def _name(self, lines: Lines) -> None:
        one, key = self._place(lines, lambda value: isinstance(value, str))
        old, new = one[key], self.word()
        one[key] = new
        if self.rng.random() < 0.4:  # everywhere, and as a key
            for one, key in self._places(lines):
                if isinstance(one, dict) and key not in one:
                    continue  # the key already has the new name
                if one[key] == old:
                    one[key] = new
                if key == old and isinstance(one, dict):
                    one[new] = one.pop(key)

    def _number(self, lines: Lines) -> None:
        one, key = self._place(lines, lambda value: isinstance(value, int | float))
        one[key] = self._hole(self.rng.choice(NUMBERS))

    def _swap(self, lines: Lines) -> None:
        """A legal value in the place of another."""
        one, key = self._place(lines, lambda value: value is not None)
        kind = type(one[key])
        other, name = self._place(lines, lambda value: type(value) is kind)
        one[key] = deepcopy(other[name])

    def _size(self, lines: Lines) -> None:
        header = lines[0].get("scenario") if isinstance(lines[0], dict) else None
        what = self.rng.randrange(6)
        kind = {2: list, 4: str, 5: dict}.get(what, object)
        one, key = self._place(lines, lambda value: isinstance(value, kind))
        if what == 0 and header:
            side = self.rng.choice((250, 512, 2000))
            header["map"] |= {"rows": side, "cols": side, "walls": []}
        elif what == 1 and header:
            robots, count = header["robots"], self.rng.choice((200, 1000, 20_000))
            robots += [robots[0] | {"name": f"r{k}"} for k in range(count)]
        elif what == 2 and isinstance(one[key], list):
            one[key] = one[key] * self._many(one[key])
        elif what == 4:
            one[key] = self._hole(f'"{"x" * self.rng.choice((10**6, 12 * 10**6))}"')
        elif what == 5 and isinstance(one[key], dict):
            one[key] |= {f"k{number}": number for number in range(50_000)}
        else:
            lines += lines[1:] * self._many(lines[1:])

    def _many(self, repeated: Any) -> int:
        """How often something may be repeated for some megabytes."""
        return min(self.rng.choice((10, 200, 10_000)), 5_000_000 // (1 + len(json.dumps(repeated))))

    def _key(self, lines: Lines) -> None:
        one, key = self._place(lines, lambda value: isinstance(value, dict) and bool(value))
        inside = one[key]
        if not isinstance(inside, dict) or not inside:
            return
        old = self.rng.choice([*inside])
        match self.rng.randrange(4):
            case 0:
                inside.pop(old)
            case 1:
                inside[self.word()] = inside.pop(old)
            case 2:
                inside[self.rng.choice(("from_", "line", "__class__", "__dict__"))] = inside[old]
            case _:
                other: Any = self.rng.choice((True, 3, "a", [], {}))
                inside[self._hole(f"{json.dumps(old)}: {json.dumps(other)}")] = 0

    def _nest(self, lines: Lines) -> None:
        one, key = self._place(lines, lambda _: True)
        depth, begin, end = self.rng.choice(DEPTHS), *self.rng.choice((("[", "]"), ('{"a":', "}")))
        one[key] = self._hole(begin * depth + "1" + end * depth)

    def _text(self, line: Any) -> str:
        text = json.dumps(line)
        for hole, value in self.raw.items():
            shown = json.dumps(hole)
            text = text.replace(f"{shown}: 0", value) if ": " in value else text
            text = text.replace(shown, value, 1 + 5_000_000 // max(1, len(value)))
        return text

    def _formulas(self, text: str) -> bytes:
        """A hostile specification."""
        lines = text.split("\n")
        at, deep = self.rng.randrange(len(lines)), self.rng.choice(DEPTHS)
        lines[at] = self.rng.choice(
            (
                *(self.word(), "x:0..." + "9" * self.rng.choice((5, 9, 12, 5000)), "\ud800"),
                *("(" * deep + "TRUE" + ")" * deep, "!" * deep + "TRUE"),
                *(" -> ".join(["TRUE"] * deep), " & ".join(["region = 1"] * min(deep, 20_000))),
                *("region = " + "9" * deep, "region''", "next(next(TRUE))"),
                lines[at] + " & " + self.word(),
            )
        )
        return "\n".join(lines).encode("utf-8", "surrogatepass")


def written(files: Files, target: Path, rng: Random) -> Path:
    """A bundle with these files and a manifest that fits, as a folder or an archive."""
    what = rng.randrange(8)
    if what < 5:
        rewrite(files, target, prove=False)
        if what == 0:
            (target / "source" / "link").symlink_to("/etc/passwd")
        return target
    with tempfile.TemporaryDirectory() as folder, zipfile.ZipFile(target, "w", 8) as archive:
        rewrite(files, Path(folder), prove=False)
        for path in Path(folder).rglob("*"):
            archive.write(path, path.relative_to(folder))
        if what == 6:
            archive.writestr("../../canary", b"escaped")
        if what == 7:
            archive.writestr("source/zeros", bytes(150_000_000))
    return target
