"""Lockstep traces converted to those of live runs: a tick becomes a pass of one second."""

from collections.abc import Iterable, Iterator

from support.damage import Line, team

RESULT = {True: "done", None: "done", False: "untraversable"}


def living(lines: Iterable[Line]) -> list[Line]:
    """Return the lines of the same run with commands and their ends instead of moves."""
    header, *rest = lines
    live = header | {"scenario": header["scenario"] | {"clock": "live"}}
    told = [live, *_Told(header).all(rest)]
    if told[-1].get("outcome") == "tick_limit":
        told[-1]["outcome"] = "time_limit"
    return told


class _Told:
    def __init__(self, header: Line) -> None:
        robots = team(header)
        self.numbers = dict.fromkeys(robots, 0)
        self.able = {name for name, robot in robots.items() if robot["model"]["capabilities"]}
        self.under_way: dict[str, int] = {}

    def all(self, lines: list[Line]) -> Iterator[Line]:
        for k, line in enumerate(lines):
            at = {"t": float(line["tick"])}
            if line["type"] == "move":
                yield from ({**one, **at} for one in self._moved(line))
                if line["robot"] in self.able and "toward" not in line:
                    yield from ({**one, **at} for one in self._acted(line, lines[k + 1 :]))
            else:
                yield {**line, **at}

    def _moved(self, line: Line) -> Iterator[Line]:
        name, here = line["robot"], line["from"]
        to = line.get("toward", line["to"])
        base = {"tick": line["tick"], "robot": name}
        step = {"from": here, "to": to, "heading": line["heading"]}
        more = {"signal": line["signal"]} if "signal" in line else {}
        if name not in self.under_way and to != here:
            number = self.numbers[name] = self.numbers[name] + 1
            if "toward" in line and line["heading"]:
                step["heading"] = self._way(here, to)
            by = line.get("by", "strategy")
            self.under_way[name] = number
            yield {"type": "depart", **base, "command": number, **step, "by": by, **more}
        if name in self.under_way and "toward" not in line:
            number, end = self.under_way.pop(name), {"at": line["to"], "heading": line["heading"]}
            yield {"type": "arrive", **base, "command": number, **end, "result": "arrived"}
        elif to == here and more:
            yield {"type": "hold", **base, **more}

    def _acted(self, line: Line, rest: list[Line]) -> Iterator[Line]:
        name = line["robot"]
        base = {"tick": line["tick"], "robot": name}
        number = self.numbers[name] = self.numbers[name] + 1
        results = {}
        for one in rest:
            if one["type"] == "move":
                break
            if one["type"] == "resolved":
                results[one["obstacle"]] = RESULT[one["traversable"]]
        yield {"type": "act", **base, "command": number, "robots": [name], "obstacles": [*results]}
        yield {"type": "acted", **base, "command": number, "results": results}

    def _way(self, here: int, to: int) -> str:
        return {1: "east", -1: "west"}.get(to - here, "south" if to > here else "north")
