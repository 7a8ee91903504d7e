"""Follows the moves of `slugs --serve` and compares them with the explicit strategy."""

import json
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from children import ran
from oracle.game import Game

Measure = tuple[int, int | None]


@dataclass
class Server:
    """The process and its first line of output."""

    process: subprocess.Popen[str]
    greeting: dict[str, Any]

    def ask(self, request: object) -> dict[str, Any]:
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(f"{json.dumps(request)}\n")
        self.process.stdin.flush()
        answer: dict[str, Any] = json.loads(self.process.stdout.readline())
        return answer

    def close(self) -> int:
        """End its input; the exit status."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.close()
        assert self.process.stdout.read() == ""
        self.process.stdout.close()
        return self.process.wait(timeout=300)


def begin(binary: Path, file: Path, *options: str) -> Server:
    process = subprocess.Popen(
        [binary, *options, "--serve", file],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    assert process.stdout is not None
    return Server(process, json.loads(process.stdout.readline()))


def difference(
    binary: Path, file: Path, *options: str, most: int = 10_000, game: Game | None = None
) -> str | None:
    """Return the first difference between serve and the explicit strategy on at most this many
    edges; None if there is none.

    Along each edge the measure must fall, too, unless the goal is met or an assumption excuses;
    with the `game`, whether it does is looked up there.
    """
    listed = ran([binary, "--explicitStrategy", "--jsonOutput", *options, file], check=True).stdout
    strategy = json.loads(listed)
    nodes = [strategy["nodes"][str(i)] for i in range(len(strategy["nodes"]))]
    server = begin(binary, file, *options)
    names = server.greeting["variables"]
    if names != strategy["variables"]:
        return f"other variables: {names}"
    inputs = [names.index(name) for name in server.greeting["inputs"]]
    outputs = [names.index(name) for name in server.greeting["outputs"]]
    measures: dict[int, Measure] = {}
    if nodes:
        first = server.ask({"start": {}})
        if first["state"] != nodes[0]["state"] or first["goal"] != 0:
            return f"starts in {first}, not in {nodes[0]}"
        state = dict(zip(names, nodes[0]["state"], strict=True))
        if server.ask({"start": state}) != first:
            return "the start depends on how much of it is given"
        measures[0] = (first["distance"], first["assumption"])
    elif server.ask({"start": {}}) != {"state": None}:
        return "starts where no state is initial"
    checked = 0
    for number, node in enumerate(nodes):
        for successor in node["trans"]:
            if checked == most:
                break
            checked += 1
            after = nodes[successor]
            given = [after["state"][i] for i in inputs]
            answer = server.ask({"state": node["state"], "goal": node["rank"], "inputs": given})
            wanted = [after["state"][i] for i in outputs]
            if answer.get("outputs") != wanted or answer["goal"] != after["rank"]:
                return f"from node {number} to {answer}, not to node {successor}: {after}"
            measure = (answer["distance"], answer["assumption"])
            if measures.setdefault(successor, measure) != measure:
                return f"node {successor} has the measures {measures[successor]} and {measure}"
            before = measures.get(number)
            kept = before is None or answer["met"] > 0 or _falls(before, measure)
            if game is not None:
                state, goal, there = _number(node), node["rank"], _number(after)
                if (answer["met"] > 0) != bool(game.guarantees[goal][state] >> there & 1):
                    return f"from node {number} to {successor} the goal is met otherwise: {answer}"
                waits = before == measure and answer["met"] == 0
                if waits and game.assumptions[measure[1] or 0][state] >> there & 1:
                    return f"from node {number} to {successor} nothing excuses waiting: {answer}"
            if not kept:
                return f"from node {number} to {successor}: {before} becomes {measure}"
    lost = _lookups(server, names, nodes)
    if lost is not None:
        return lost
    status = server.close()
    return None if status == 0 else f"exit status {status}"


def _lookups(server: Server, names: list[str], nodes: list[dict[str, Any]]) -> str | None:
    """Where the nodes that are found by all or some of their values differ from the listed ones."""
    for number in {*range(min(len(nodes), 5)), len(nodes) // 2, len(nodes) - 1} if nodes else ():
        for step in (1, 2, 3):
            columns = range(number % step, len(names), step)
            wanted = {names[c]: nodes[number]["state"][c] for c in columns}
            first = next(
                n for n in nodes if all(n["state"][c] == wanted[names[c]] for c in columns)
            )
            found = server.ask({"find": wanted, "nodes": len(nodes)})
            if (found["state"], found["goal"]) != (first["state"], first["rank"]):
                return f"finds {found} for {wanted}, not {first}"
    states = {tuple(node["state"]) for node in nodes}
    for missing in range(min(2 ** len(names), 64)):
        state = [missing >> c & 1 for c in range(len(names))]
        if tuple(state) not in states:
            found = server.ask({"find": dict(zip(names, state, strict=True)), "nodes": len(nodes)})
            return None if found == {"state": None} else f"finds {found}, which is not listed"
    return None


def _number(node: dict[str, Any]) -> int:
    """A state as the oracle numbers it."""
    return int("".join(map(str, node["state"])) or "0", 2)


def _falls(before: Measure, after: Measure) -> bool:
    return after[0] < before[0] or (after == before and before[1] is not None)
