"""The charges of robots along the log of a world."""

from collections.abc import Mapping, Sequence
from typing import Any

Line = Mapping[str, Any]
CLOSE = 1e-5
"""Of a charge: seconds of a log are not rounded."""


class Charges:
    """The charges of robots along a log without new batteries: a step takes ``move`` when it
    ends, a second without one ``stay``, or gives ``charge`` on a charger. A robot stands from the
    moment on at which the team is told of the end of its step. ``starts``: regions; ``defects``:
    steps without charge."""

    def __init__(
        self, data: Mapping[str, Any], starts: Mapping[str, int], log: Sequence[Line]
    ) -> None:
        models = (data.get("catalogue") or {}).get("robots") or {}
        robots = data["robots"].items()
        self.batteries = {n: models.get(r["model"], {}).get("battery") for n, r in robots}
        self.batteries = {n: b for n, b in self.batteries.items() if b and "flat" not in data}
        self.chargers = {*data.get("chargers", ())}
        self.charge = {n: float(b.get("start", b["capacity"])) for n, b in self.batteries.items()}
        self.at = {**starts}
        self.since: dict[str, float | None] = dict.fromkeys(self.batteries, 0.0)
        self.under_way: dict[str, int] = {}
        self.defects: list[str] = []
        for line in log:
            if line.get("robot") in self.batteries:
                self._follow(line, line["robot"])

    def _pass(self, name: str, t: float) -> None:
        """Let a robot that stands have stood until then."""
        battery, since = self.batteries[name], self.since[name]
        if since is None:
            return
        on = self.at[name] in self.chargers
        rate = battery["charge"] if on else -battery.get("stay", 0)
        charge = self.charge[name] + rate * (t - since)
        self.charge[name] = min(battery["capacity"], max(0.0, charge))
        self.since[name] = t

    def _follow(self, line: Line, name: str) -> None:
        move = self.batteries[name].get("move", 1)
        match line["log"]:
            case "start":
                self._pass(name, line["t"])
                self.since[name], self.under_way[name] = None, line["command"]
                if self.charge[name] < move - CLOSE:
                    told = f"{name} sets out with a charge of {self.charge[name]:g}"
                    self.defects.append(f"{line['t']:.2f} s: {told}")
            case "end":
                self.charge[name] = max(0.0, self.charge[name] - move)
                self.at[name] = line["at"]
            case "told" if line["command"] == self.under_way.get(name):
                del self.under_way[name]
                self.since[name] = line["t"]
                self._pass(name, line["t"])
            case "put":
                self._pass(name, line["t"])
                self.at[name] = line["at"]
            case _:
                pass
