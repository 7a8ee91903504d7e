"""Reasons why a request has no helpers, or others than expected, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from safenav.solve.duties import Settlement
from safenav.solve.reasons import need_words, number_words
from safenav.team.floor import barred, floor_now, stages_of, without_memory
from safenav.team.state import State
from safenav.team.team import Team
from safenav.trace.words import listed, obstacle_words

ASIDE = "no order of moves lets them resolve it now"
_UNSERVED = "if a robot went there now, the team could not continue"


class Request:
    """An open request ``k`` at this moment; ``found``: who does what."""

    def __init__(self, team: Team, state: State, found: Settlement, k: int) -> None:
        team, state = without_memory(team, state)
        self.team, self.state, self.found, self.k = team, state, found, k
        self.floor = floor_now(team, state)
        self.stages, self.g = stages_of(self.floor, state), self.floor.gates.index(k)
        self.need = self.floor.need(self.g, self.stages)
        self.poses = tuple(robot.next for robot in state.robots)

    def why_nobody(self) -> str | None:
        """The reason why no robot helps now, although some could get there; None if the bids show
        it."""
        floor, stage, g = self.floor, self.stages[self.g], self.g
        able, missing = floor.able(g, self.stages), floor.missing(g, self.stages)
        out = [i for i in self._skilled() if not self.state.robots[i].active]
        if len(able) + len(out) < missing:
            if loads := self._loads():
                return loads
            strays = [i for i in floor.skilled(g, self.stages) if i in self._strays()]
            if strays:
                return f"no path leads {self._names(strays)} to where it is put down"
            need = self.need
            actions = "' and '".join((need.action, *sorted(need.skills - {need.action})))
            takes = need_words(actions, need.robots, together=need.together)
            have = number_words(len(able) + len(stage.done))
            return f"it needs {takes}, this team has {have}" if able else None
        if len(able) < missing:
            return f"{self._names(out)} {'is' if len(out) == 1 else 'are'} out of service"
        duties, parts = self.found.duties, []
        for i in able:
            first = next((step for step in self.found.plan if i in step.group), None)
            if i in duties and duties[i].g != g:
                parts.append(self._doing("helps with", i, duties[i].g))
            elif i not in duties and first is not None and first.g != g:
                parts.append(self._doing("is to help first with", i, first.g))
        if parts:
            return "; ".join(parts)
        if g not in self.found.served:
            return _UNSERVED if sum(map(self._gets_there, able)) >= missing else None
        earlier = dict.fromkeys(step.g for step in self.found.plan if step.g != g)
        return f"first {listed(map(self._obstacle, earlier))} must be resolved" if earlier else None

    def why_others(
        self, helpers: Sequence[int], before: Sequence[str], bids: Mapping[str, int | None]
    ) -> str | None:
        """The reasons why robots that fail, are out of service, or are nearer than the helpers do
        not help; None if the bids show it. ``before``: the helpers until now."""
        names = [self.team.members[i].name for i in helpers]
        last = max((bids.get(name) or 0 for name in names), default=0)
        reasons: dict[str, list[int]] = {}
        for i in self._skilled():
            ticks, duty, why = bids.get(self.team.members[i].name), self.found.duties.get(i), ""
            if i in helpers:
                continue
            if (i, self.k) in barred(self.team, self.state):
                why = "has failed"
            elif not self.state.robots[i].active:
                why = "is out of service"
            elif ticks is None or ticks >= last:
                continue
            elif duty is not None and duty.g != self.g:
                why = f"is to help with {self._obstacle(duty.g)}"
            elif not self._returns(i):
                why = "could not return from there"
            elif {*names} <= {*before}:
                why = f"is nearer, but {listed(names)} helps already"
            reasons.setdefault(why, []).append(i)
        reasons.pop("", None)
        plural = {"has failed": "have failed", "is out of service": "are out of service"}
        words = (plural.get(why, why) if len(who) > 1 else why for why, who in reasons.items())
        pairs = zip(map(self._names, reasons.values()), words, strict=True)
        return "; ".join(map(" ".join, pairs)) or None

    def _skilled(self) -> list[int]:
        """The robots that have the next need's actions, also those out of service."""
        stage, members = self.stages[self.g], self.team.members
        chosen = range(len(members)) if stage.group is None else sorted(stage.group)
        able = [i for i in chosen if self.need.skills <= members[i].robot.capabilities]
        return [i for i in able if i not in stage.done]

    def _strays(self) -> frozenset[int]:
        return self.floor.gate(self.g).strays[self.stages[self.g].need]

    def _loads(self) -> str:
        """The loads of robots that cannot take another one; empty if there are none."""
        floor, parts = self.floor, []
        carrying = floor.carriers(self.stages) if self.need.takes else frozenset()
        for i in carrying.intersection(floor.skilled(self.g, self.stages)):
            taken = {g: {*stage.done, *(stage.group or ())} for g, stage in enumerate(self.stages)}
            loads = [self._obstacle(g) for g in floor.open(self.stages) if i in taken[g]]
            parts.append(f"{self.team.members[i].name} carries {listed(loads)}")
        return "; ".join(sorted(parts))

    def _gets_there(self, i: int) -> bool:
        graph, allowed = self.floor.graphs[i], self.floor.allowed(i, self.stages)
        there = graph.closure(1 << self.poses[i], allowed)
        return bool(there & graph.poses_on(self.need.regions))

    def _returns(self, i: int) -> bool:
        """Whether a robot could return to its pose after it has met the next need."""
        floor, graph, pose = self.floor, self.floor.graphs[i], 1 << self.poses[i]
        there = graph.closure(pose, floor.allowed(i, self.stages))
        then = floor.allowed(i, floor.advanced(self.g, self.stages, (i,)))
        return bool(graph.closure(there & graph.poses_on(self.need.regions), then) & pose)

    def _names(self, robots: Sequence[int]) -> str:
        return listed(self.team.members[i].name for i in robots)

    def _obstacle(self, g: int) -> str:
        return obstacle_words(self.floor.gate(g).name, self.team.world.word)

    def _doing(self, what: str, i: int, g: int) -> str:
        return f"{self.team.members[i].name} {what} {self._obstacle(g)}"


def left_words(team: Team, state: State, found: Settlement, k: int, lacks: str | None) -> str:
    """Describe an order that is still open when the mission is completed, and why. ``lacks``: the
    words for what it lacks, if it is given up."""
    name, why = team.obstacles[k].name, lacks
    if why is None and k in state.requests:
        why = Request(team, state, found, k).why_nobody()
    return f"{name} ({why})" if why else name
