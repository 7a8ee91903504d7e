"""Tools of a forger: honest bundles, and traces that end where he wants."""

from collections.abc import Callable, Iterator
from typing import Any

from certify.making import Files
from certify.mutants import lines_of, with_lines

Line = dict[str, Any]
Forge = Callable[[list[Line]], None]


def retold(forge: Forge) -> Callable[[Files], Files]:
    """A forgery of the lines of the trace, the header first."""

    def alter(files: Files) -> Files:
        lines = lines_of(files)
        forge(lines)
        return with_lines(files, lines)

    return alter


def first(lines: list[Line], kind: str, **fields: object) -> int:
    """The position of the first line of a type with these fields."""
    return next(
        k for k, line in enumerate(lines) if line["type"] == kind and fields.items() <= line.items()
    )


def ends(lines: list[Line], at: int, outcome: str, **fields: object) -> None:
    """Let the run end before the line ``at``, with counts that fit."""
    last = lines[-1]
    del lines[at:]
    tick = lines[-1].get("tick", 0)
    rounds = dict.fromkeys(lines[0]["scenario"]["robots"], 0)
    rounds |= {line["robot"]: line["round"] for line in lines if line["type"] == "goal"}
    asked = sum(line["type"] == "synthesis" for line in lines)
    told = {"outcome": outcome, "tick": tick, "ticks": tick, "rounds": rounds, "syntheses": asked}
    for key in ("cause", "proof", "unrealizable"):
        last.pop(key, None)
    lines.append(last | told | fields)


def objectives_of(lines: list[Line]) -> Iterator[Line]:
    """The robots' objectives in the header, and those of syntheses."""
    yield from (robot["objective"] for robot in lines[0]["scenario"]["robots"].values())
    yield from (line["objective"] for line in lines if line["type"] == "synthesis")
