"""The wording of trace lines for people, in scenario terms: one sentence for each line.

The story of a run on the terminal, the page, the pictures and the terminal replay use these same
sentences; they only differ in how they show robots and regions.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

from msgspec import Struct, field

from safenav.errors import Verdict
from safenav.scenario.model import OPERATOR_ACTION
from safenav.scenario.objective import Objective, Word, describe, number_word
from safenav.trace import records, vocabulary
from safenav.trace.words import (
    MANY,
    counted,
    obstacle_words,
    seconds_words,
    some,
)
from safenav.world.map import Region

_WHY = {
    vocabulary.Reason.INITIAL: "before the start",
    vocabulary.Reason.REQUEST: "for a request",
    vocabulary.Reason.RESOLVED: "after a resolution",
    vocabulary.Reason.BLOCKED: "around a blocked region",
    vocabulary.Reason.GONE: "after an obstacle disappeared",
    vocabulary.Reason.OBJECTIVE: "for another objective",
    vocabulary.Reason.SERVICE: "back in service",
}

_BLOCKED = {
    vocabulary.BlockReason.UNTRAVERSABLE: "it is not traversable",
    vocabulary.BlockReason.NO_CAPABLE_ROBOT: "too few robots have the action it needs",
    vocabulary.BlockReason.UNRESOLVABLE: "no robot can ever resolve it",
    vocabulary.BlockReason.OPERATOR: "an operator reports that it is permanent",
}

_UNCOUNTED = (
    "debris dirt dust fire fog glass gravel ice mud oil rubble sand smoke snow uncertainty water"
)
"""Kinds of obstacles without a plural, and so without an article."""
_LISTED_ROBOTS = 4
"""Largest team that is listed by name when all of it is meant."""

_OBSTACLE = re.compile(r"[\w-]+@\d+(?:#\d+)?")
_PLAN_OVER = {
    vocabulary.PlanEndReason.REACHED: "every robot has arrived",
    vocabulary.PlanEndReason.VIOLATION: "an obstacle is in its way",
    vocabulary.PlanEndReason.CHANGED: "the situation has changed",
}


_CHANGES = {
    "appeared": "appears",
    "gone": "disappears",
    "order": "is ordered",
    "reopened": "may be resolvable again",
}


class Wording(Struct, frozen=True):
    """The wording of a run. ``word``: a region's name in obstacles and objectives; ``place``: a
    region's name as the place of an event (default: the same); ``robot`` and ``strong`` mark up
    names of robots and what matters most; ``team``: number of robots; ``actions``: the action of
    each need of an obstacle, ``skills``: the capabilities of each robot, if known. ``live``: the
    scenario counts seconds (None: if the lines have them)."""

    word: Word = number_word
    place: Callable[[Region], str] | None = None
    robot: Callable[[str], str] = str
    strong: Callable[[str], str] = str
    team: int | None = None
    actions: Mapping[str, Sequence[str]] = field(default_factory=dict)
    skills: Mapping[str, Collection[str]] = field(default_factory=dict)
    live: bool | None = None

    def _is_live(self, line: records.Record) -> bool:
        return line.t is not None if self.live is None else self.live

    def sentence(self, line: records.Record) -> str:
        """Return a line without its full stop. Raises TypeError for one that is not an event."""
        sentences = self._of_obstacle(line) or self._of_robot(line) or self._of_team(line)
        if sentences is None:
            raise TypeError(f"{line.type} is not an event")
        return sentences

    def _of_obstacle(self, line: records.Record) -> str | None:
        match line:
            case records.Violation():
                return self._violation(line)
            case records.Request():
                return self._request(line)
            case records.Met():
                return self._met(line)
            case records.Resolved():
                return self._resolved(line)
            case records.KnownObstacle():
                obstacle = self.strong(self.obstacle(line.obstacle))
                why = line.because or _BLOCKED[line.reason]
                if not line.robots:  # for example, an order
                    return f"{obstacle} stays unresolved: {why}"
                robots = self._all(line.robots)
                if line.for_now:
                    return f"{obstacle} blocks {robots} for now: {why}"
                return f"{obstacle} permanently blocks {robots}: {why}"
            case records.Deadline():
                return self._deadline(line)
            case records.Truth():
                truth = "traversable" if line.traversable else "not traversable"
                return f"{self.strong(self.obstacle(line.obstacle))} is {truth} from now on"
            case records.Appeared() | records.Gone() | records.Ordered() | records.Reopened():
                return f"{self.strong(self.obstacle(line.obstacle))} {_CHANGES[line.type]}"
        return None

    def _of_robot(self, line: records.Record) -> str | None:
        match line:
            case records.Synthesis():
                found = synthesis_words(line)
                return f"synthesis for {self.robot(line.robot)} {_WHY[line.reason]}: {found}"
            case records.NewObjective():
                told = self.objective(line.objective)
                return f"{self.robot(line.robot)} gets another objective: {told}"
            case records.Told():
                return f"{self.robot(line.robot)} now pursues: {self.objective(line.objective)}"
            case records.Service():
                what = "is back in service" if line.active else "is out of service"
                failed = not line.active and line.cause is vocabulary.ChangeCause.WORLD
                return f"{self.robot(line.robot)} {what}{' after this failure' if failed else ''}"
            case records.Goal():
                return self.goal(line)
            case records.Assumption():
                return f"{self.robot(line.robot)}: assumption violated: {line.name}"
            case records.Depart():
                route = f"from {self._at(line.from_)} to {self._at(line.to)}"
                return f"{self.robot(line.robot)} departs {route}"
            case records.Arrive():
                where = f"{self.robot(line.robot)} is at {self._at(line.at)}"
                if line.result is vocabulary.MoveEnd.ARRIVED:
                    again = f", after another attempt ({line.reason})" if line.reason else ""
                    return where + again
                why = f" ({line.reason})" if line.reason else ""
                return f"{where}, its step has ended: {line.result.value}{why}"
            case records.Act():
                names = " and ".join(map(self.obstacle, line.obstacles))
                verb = "act" if len(line.robots) > 1 else "acts"
                return f"{self._all(frozenset(line.robots))} {verb} on {names or 'what is there'}"
            case records.ActionEnd():
                results = (f"{self.obstacle(name)}: {done}" for name, done in line.results.items())
                sentences = line.reason and line.reason not in map(str, line.results.values())
                ends = ", ".join([*results, *([line.reason] if line.reason and sentences else [])])
                return f"the action of {self.robot(line.robot)} ends ({ends})"
        return None

    def _of_team(self, line: records.Record) -> str | None:
        match line:
            case records.Push():
                return f"objectives pushed, depth {line.depth}"
            case records.Pop():
                return f"objectives restored, depth {line.depth} ({self.obstacle(line.obstacle)})"
            case records.Inputs():
                on = sorted(name for name, value in line.values.items() if value)
                return f"inputs: {' and '.join(on) or 'none'} on"
            case records.Plan():
                reason = _OBSTACLE.sub(lambda found: self.obstacle(found[0]), line.reason)
                count, whole = len(line.robots), "all " * (len(line.robots) == self.team)
                who = f"{whole}{count} robots" if count > MANY else self._all(line.robots)
                return f"{who} {'moves' if count == 1 else 'move'} by a joint plan ({reason})"
            case records.PlanEnd():
                return f"the joint plan has ended: {_PLAN_OVER[line.reason]}"
            case records.Late():
                about = line.robot or line.obstacle
                what = f"{line.event} of {about}" if about else line.event
                return f"a report is dropped ({what}): {line.reason}"
            case records.Waiting() if line.until is not None:
                live, at = self._is_live(line), f"tick {line.until:.0f}"
                when = seconds_words(line.until) if live else at
                return (
                    f"the team waits for the change of the scenario at {when}: {line.explanation}"
                )
            case records.Waiting():
                return f"the team waits for an operator: {line.explanation}"
            case records.Operator():
                return f"an operator intervenes: {self._operator(line)}"
            case records.Resumed():
                return "the run was interrupted and continues"
            case records.End():
                text = line.outcome.value.replace("_", " ")
                return f"{text}: {line.explanation}" if line.explanation else text
        return None

    def _violation(self, line: records.Violation) -> str:
        kind = self.strong(with_article(line.obstacle.partition("@")[0]))
        found = f"finds {kind} at {self._at(line.proposed)} and keeps out"
        who = f"{self.robot(line.robot)} at {self._at(line.at)}"
        if line.action == OPERATOR_ACTION:
            if line.obstacle.startswith(f"lost_{line.robot}@"):
                return f"{who} is lost: it may also be at {self._at(line.proposed)}"
            if line.obstacle.startswith("unknown_"):  # its steps failed, or it was stopped
                unknown = self.strong(self.obstacle(line.obstacle))
                found = f"cannot enter {self._at(line.proposed)}, which counts as {unknown}"
            return f"{who} {found}: only an operator can resolve it"
        if line.action in self.skills.get(line.robot, ()):
            return f"{who} {found} until '{line.action}' is done"
        return f"{who} {found}: it lacks '{line.action}'"

    def goal(self, line: records.Goal, *, formulas: bool = False) -> str:
        """``quad reaches dock, round 1 done``. ``formulas``: the goal is one of formulas, which the
        step that leaves a region may meet."""
        does = f"meets goal {line.goal + 1} of its formulas at" if formulas else "reaches"
        done = f", round {line.round} done" if line.round else ""
        return f"{self.robot(line.robot)} {does} {self._at(line.region)}{done}"

    def _deadline(self, line: records.Deadline) -> str:
        """``door@47 cannot be resolved before tick 16, and is due at tick 15``."""
        if "@" in line.of:
            what = self.strong(self.obstacle(line.of))
            does, done = "be resolved", "is resolved"
        elif line.of == "mission":
            what, does, done = "the mission", "be completed", "is completed"
        else:
            what, does, done = f"the round of {self.robot(line.of)}", "end", "ends"
        cannot = f"cannot {does} before tick {line.earliest}"
        if line.earliest is None:
            cannot = f"can never {does}"
        match line.verdict:
            case vocabulary.DeadlineVerdict.SET:
                return f"{what} is due at tick {line.due}"
            case vocabulary.DeadlineVerdict.LOST:
                return f"{what} {cannot}, and is due at tick {line.due}"
            case vocabulary.DeadlineVerdict.KEPT:
                return f"{what} {done} in time (due at tick {line.due})"
            case vocabulary.DeadlineVerdict.EXCUSED:
                return f"{what}, due at tick {line.due}, is excused"
        return f"{what} has missed its deadline, tick {line.due}"

    def _operator(self, line: records.Operator) -> str:
        back = line.intervention is vocabulary.OperatorIntervention.ADDED
        what = "back in service" if back else line.intervention.value.replace("_", " ")
        words = [self.obstacle(line.obstacle)] if line.obstacle else []
        words += [self.robot(line.robot)] if line.robot else []
        words += [f"at {self._at(line.region)}"] if line.region is not None else []
        words += [self.objective(line.objective)] if line.objective else []
        return f"{what} {' '.join(words)}".rstrip()

    def objective(self, objective: Objective) -> str:
        """An objective in a few words."""
        return describe(objective, self.word)

    def obstacle(self, name: str) -> str:
        """``door@47``, or ``door@dock`` where the region has a name."""
        return obstacle_words(name, self.word)

    def backing_up(self, violation: records.Violation, backtrack: records.Backtrack) -> str:
        """A violation and the safe action that was taken instead."""
        stays = backtrack.to == violation.at
        where = "it stays" if stays else f"it goes to {self._at(backtrack.to)}"
        return f"{self.sentence(violation)}; {where}"

    def holding(self, line: records.Goal) -> str:
        """The goal of a robot that must stay where it is."""
        return f"{self.robot(line.robot)} holds {self._at(line.region)}"

    def _request(self, line: records.Request) -> str:
        helpers, about = line.helpers, self.obstacle(line.obstacle)
        if line.need is not None:
            about += f" (need {line.need + 1})"
        live = self._is_live(line)  # a bid counts ticks of the slowest step, whatever its seconds
        bids = ", ".join(
            f"{name} cannot come"
            if bid is None
            else f"{name} bids {bid}"
            if live
            else f"{name} needs {counted(bid, 'tick')}"
            for name, bid in line.bids.items()
        )
        why = f", since {line.because}" if helpers and line.because else ""
        if line.requester is not None and helpers == (line.requester,):
            actions = self.actions.get(line.obstacle, ())
            act = actions[line.need or 0] if actions else "resolve"
            return f"{self.robot(line.requester)} goes to {act} it itself: {about}; {bids}{why}"
        help_ = f"{self._all(helpers)} {'helps' if len(helpers) == 1 else 'help'}{why}"
        asks = f"order of {about}"
        if line.requester is not None:
            asks = f"{self.robot(line.requester)} requests help with {about}"
        if not helpers:
            help_ = f"no robot helps: {line.because}" if line.because else "no robot helps"
            bids = bids or ("" if line.because else "no robot has the capability")
        if not helpers and not bids:
            return f"{asks}, but {help_}"
        return f"{asks}: {bids}; {help_}" if bids else f"{asks}: {help_}"

    def _met(self, line: records.Met) -> str:
        what = f"need {line.need + 1} of {self.strong(self.obstacle(line.obstacle))}"
        met = f"{self.robot(line.robot)} at {self._at(line.at)} fulfils {what}"
        return f"{met}{self._with(line)}: {line.action}"

    def _resolved(self, line: records.Resolved) -> str:
        who, what = self.robot(line.robot), self.strong(self.obstacle(line.obstacle))
        several = len(self.actions.get(line.obstacle, ())) > 1  # the line before names the others
        text = f"{who} at {self._at(line.at)} resolves {what}{'' if several else self._with(line)}"
        if line.traversable is not None:
            text += ", which is traversable" if line.traversable else ", which is not traversable"
        return text if line.requested else text + " (without a request)"

    def _with(self, line: records.Met | records.Resolved) -> str:
        """Return the others that took part, which may be elsewhere."""
        others = [name for name in line.robots or () if name != line.robot]
        return f" with {self._all(others)}" if others else ""

    def _at(self, region: Region) -> str:
        return (self.place or self.word)(region)

    def _all(self, names: Iterable[str]) -> str:
        if isinstance(names, frozenset):
            if len(names) == self.team and self.team > _LISTED_ROBOTS:
                return f"all {self.team} robots"
            names = sorted(names, key=_natural)
        return some(self.robot(name) for name in names)


def synthesis_words(line: records.Synthesis) -> str:
    """The result of a synthesis: ``21 states in 3 ms, verified``."""
    found = line.verdict.value.replace("_", " ")
    if line.verdict is Verdict.REALIZABLE and line.states is not None:
        found = counted(line.states, "state")
    spent = ", from the cache" if line.cached else f" in {seconds_words(line.seconds)}"
    proof = {None: "", True: ", verified", False: ", verification failed"}[line.verified]
    return f"{found}{spent}{proof}"


def _natural(name: str) -> list[tuple[int, str]]:
    """Return a key for natural order: ``rover_2`` before ``rover_10``."""
    return [(int(part or 0), text) for text, part in re.findall(r"(\D*)(\d*)", name)]


def with_article(kind: str) -> str:
    """``a door``, ``an obstacle``, ``rubble``."""
    if kind.lower() in _UNCOUNTED.split():
        return kind
    return f"{'an' if kind[:1].lower() in tuple('aeiou') else 'a'} {kind}"
