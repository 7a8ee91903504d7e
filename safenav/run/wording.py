"""The wording of trace lines for people, in scenario terms: one sentence per line, the same on the
terminal and page, and in pictures, bags and tables."""

import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

from msgspec import Struct, field

from safenav.errors import Verdict
from safenav.scenario.model import OPERATOR_ACTION, Clock
from safenav.scenario.objective import describe
from safenav.trace import records, vocabulary
from safenav.trace.words import MANY, counted, obstacle_words, seconds_words, some
from safenav.world.map import Region, RegionMap

_SENTENCES = {
    "appeared": "{obstacle} appears",
    "gone": "{obstacle} disappears",
    "order": "{obstacle} is ordered",
    "reopened": "{obstacle} may be resolvable again",
    "objective": "{robot} gets another objective: {objective}",
    "assumption": "{robot}: assumption violated: {name}",
    "depart": "{robot} departs from {from_} to {to}",
    "push": "objectives pushed, depth {depth}",
    "pop": "objectives restored after {obstacle}, depth {depth}",
    "plan_end": "the joint plan has ended: {reason}",
    "resumed": "the run is resumed",
}
"""Sentences of lines by type, with placeholders for their fields in words."""

_REASONS = {
    "untraversable": "it is not traversable",
    "no_capable_robot": "too few robots have the action it needs",
    "unresolvable": "no robot can ever resolve it",
    "operator": "an operator reports that it is permanent",
    "reached": "every robot has arrived",
    "violation": "an obstacle is in its way",
    "changed": "the situation has changed",
}
"""Reasons for permanent obstacles and for ends of joint plans."""

_LISTED_ROBOTS = 4
"""Maximum size of a team whose robots are listed by name."""
_OBSTACLE = re.compile(r"[\w-]+@\d+(?:#\d+)?")


class Wording(Struct, frozen=True):
    """The wording of the lines of a run. ``place``: function that returns the name of an event's
    place; ``skills``: the capabilities of each robot; ``actions``: the action of each need of an
    obstacle; ``live``: whether the scenario counts seconds."""

    map: RegionMap
    place: Callable[[RegionMap, Region], str] = RegionMap.place
    skills: Mapping[str, Collection[str]] = field(default_factory=dict)
    actions: dict[str, Sequence[str]] = field(default_factory=dict)
    live: bool = False

    def sentence(self, line: records.Record) -> str:
        """Return the sentence for a line. Raises TypeError for a line that is not an event."""
        if line.type in _SENTENCES:
            return re.sub(r"{(\w+)}", lambda key: self._field(line, key[1]), _SENTENCES[line.type])
        match line:
            case records.Violation():
                return self._violation(line)
            case records.Request():
                return self._request(line)
            case records.Duty():
                each = ((n, describe(own, self.map.word)) for n, own in line.objectives.items())
                return "; ".join(f"{name} now pursues: {own}" for name, own in each)
            case records.Part():
                does = "does its part of" if line.missing else "fulfils"
                met = f"{line.robot} at {self._at(line.at)} {does} need {line.need + 1}"
                what = f"{met} of {self.obstacle(line.obstacle)}"
                return f"{what}{self._with(line)}: {line.action}"
            case records.Resolved():
                return self._resolved(line)
            case records.KnownObstacle():
                obstacle, why = self.obstacle(line.obstacle), line.because or _REASONS[line.reason]
                if not line.robots:  # for example, an order
                    return f"{obstacle} stays unresolved: {why}"
                if line.for_now:
                    return f"{obstacle} blocks {self._all(line.robots)} for now: {why}"
                return f"{obstacle} permanently blocks {self._all(line.robots)}: {why}"
            case records.Deadline():
                return self._deadline(line)
            case records.Truth():
                truth = "traversable" if line.traversable else "not traversable"
                return f"{self.obstacle(line.obstacle)} is {truth} from now on"
            case records.Synthesis():
                return f"synthesis for {line.robot}: {synthesis_words(line)}"
            case records.Service():
                what = "is back in service" if line.active else "is out of service"
                failed = not line.active and line.cause is vocabulary.ChangeCause.WORLD
                return f"{line.robot} {what}{' after this failure' if failed else ''}"
            case records.Goal():
                return self.goal(line, "reaches")
            case records.Arrive():
                where = f"{line.robot} is at {self._at(line.at)}"
                if line.result is vocabulary.MoveEnd.ARRIVED:
                    return where + (f", after another attempt ({line.reason})" * bool(line.reason))
                why = f" ({line.reason})" if line.reason else ""
                return f"{where}, its step has ended: {line.result.value}{why}"
            case records.Act():
                names = " and ".join(map(self.obstacle, line.obstacles)) or "an unknown obstacle"
                verb = "act" if len(line.robots) > 1 else "acts"
                return f"{self._all(frozenset(line.robots))} {verb} on {names}"
            case records.ActionEnd():
                ends = [f"{self.obstacle(name)}: {done}" for name, done in line.results.items()]
                if line.reason and line.reason not in map(str, line.results.values()):
                    ends.append(line.reason)
                return f"the action of {line.robot} ends ({', '.join(ends)})"
            case records.Inputs():
                on = sorted(name for name, value in line.values.items() if value)
                return f"inputs: {' and '.join(on)} on" if on else "inputs: all off"
            case records.Plan():
                reason = _OBSTACLE.sub(lambda found: self.obstacle(found[0]), line.reason)
                some = [name for name, way in line.robots.items() if len(way) > 1] or [*line.robots]
                count, whole = len(some), "all " * (len(some) == len(self.skills))
                who = f"{whole}{count} robots" if count > MANY else self._all(some)
                return f"{who} {'moves' if count == 1 else 'move'} by a joint plan ({reason})"
            case records.Late():
                about = line.robot or line.obstacle
                what = f"{line.event} of {about}" if about else line.event
                return f"dropped: {what}: {line.reason}"
            case records.Waiting():
                awaited = "an operator"
                if line.until is not None:
                    at = seconds_words(line.until) if self.live else f"tick {line.until:.0f}"
                    awaited = f"the change of the scenario at {at}"
                return f"the team waits for {awaited}: {line.explanation}"
            case records.Operator():
                return f"an operator intervenes: {self._operator(line)}"
            case records.End():
                text = line.outcome.value.replace("_", " ")
                return f"{text}: {line.explanation}" if line.explanation else text
        raise TypeError(f"{line.type} is not an event")

    def _field(self, line: records.Record, name: str) -> str:
        """Return one field of a line in words."""
        value = getattr(line, name)
        if name == "obstacle":
            return self.obstacle(value)
        if name == "objective":
            later = "" if getattr(line, "at_once", True) else ", once it no longer waits or helps"
            return describe(value, self.map.word) + later
        if name == "reason":
            return _REASONS[value]
        return self._at(value) if name in ("from_", "to") else str(value)

    def _violation(self, line: records.Violation) -> str:
        found = f"finds {self.obstacle(line.obstacle)} and keeps out"
        who = f"{line.robot} at {self._at(line.at)}"
        if line.action == OPERATOR_ACTION:
            if line.obstacle.startswith(f"lost_{line.robot}@"):
                return f"{who} is lost: it may also be at {self._at(line.proposed)}"
            if line.obstacle.startswith("unknown_"):  # the robot's steps failed or it was stopped
                unknown = self.obstacle(line.obstacle)
                found = f"cannot enter {self._at(line.proposed)}, which counts as {unknown}"
            return f"{who} {found}: only an operator can resolve it"
        if line.action in self.skills.get(line.robot, ()):
            return f"{who} {found} until '{line.action}' is done"
        return f"{who} {found}: it lacks '{line.action}'"

    def goal(self, line: records.Goal, does: str) -> str:
        """Return a goal line in words: ``quad reaches dock, round 1 done``."""
        done = f", round {line.round} done" if line.round else ""
        return f"{line.robot} {does} {self._at(line.region)}{done}"

    def _deadline(self, line: records.Deadline) -> str:
        """Return ``door@47 cannot be resolved before tick 16, and is due at tick 15``."""
        what, does, done = f"the round of {line.of}", "end", "ends"
        if "@" in line.of:
            what, does, done = self.obstacle(line.of), "be resolved", "is resolved"
        elif line.of == "mission":
            what, does, done = "the mission", "be completed", "is completed"
        cannot = f"cannot {does} before tick {line.earliest}"
        if line.earliest is None:
            cannot = f"can never {does}"
        words = {
            vocabulary.DeadlineVerdict.SET: f"is due at tick {line.due}",
            vocabulary.DeadlineVerdict.LOST: f"{cannot}, and is due at tick {line.due}",
            vocabulary.DeadlineVerdict.KEPT: f"{done} in time (due at tick {line.due})",
            vocabulary.DeadlineVerdict.EXCUSED: f"due at tick {line.due}, is excused",
            vocabulary.DeadlineVerdict.LATE: f"has missed its deadline, tick {line.due}",
        }
        comma = "," * (line.verdict is vocabulary.DeadlineVerdict.EXCUSED)
        return f"{what}{comma} {words[line.verdict]}"

    def _operator(self, line: records.Operator) -> str:
        back = line.intervention is vocabulary.OperatorIntervention.ADDED
        what = "back in service" if back else line.intervention.value.replace("_", " ")
        words = [self.obstacle(line.obstacle)] if line.obstacle else []
        words += [line.robot] if line.robot else []
        words += [f"at {self._at(line.region)}"] if line.region is not None else []
        words += [describe(line.objective, self.map.word)] if line.objective else []
        return f"{what} {' '.join(words)}".rstrip()

    def obstacle(self, name: str) -> str:
        """Return an obstacle's name: ``door@47``, or ``door@dock`` if the region has a name."""
        return obstacle_words(name, self.map.word)

    def instead(self, violation: records.Violation, backtrack: records.Backtrack) -> str:
        """Return, in words, the safe action by which a robot avoids a violation."""
        stays = backtrack.to == violation.at
        return "it stays" if stays else f"it goes to {self._at(backtrack.to)}"

    def _request(self, line: records.Request) -> str:
        helpers, about = line.helpers, self.obstacle(line.obstacle)
        if line.need is not None:
            about += f" (need {line.need + 1})"
        bids = ", ".join(f"{name} {self._bid(bid)}" for name, bid in line.bids.items())
        why = f", since {line.because}" if helpers and line.because else ""
        if line.requester is not None and helpers == (line.requester,):
            actions = self.actions.get(line.obstacle, ())
            act = actions[line.need or 0] if actions else "resolve"
            return f"{line.requester} goes to {act} {about} itself: {bids}{why}"
        help_ = f"{self._all(helpers)} {'helps' if len(helpers) == 1 else 'help'}{why}"
        asks = f"order of {about}"
        if line.requester is not None:
            asks = f"{line.requester} requests help with {about}"
        if not helpers:
            help_ = f"no robot helps: {line.because}" if line.because else "no robot helps"
            bids = bids or ("" if line.because else "no robot has the capability")
        if not helpers and not bids:
            return f"{asks}, but {help_}"
        return f"{asks}: {bids}; {help_}" if bids else f"{asks}: {help_}"

    def _bid(self, bid: float | None) -> str:
        if bid is None:
            return "has no free path now"
        return f"needs {bid:.1f} s" if self.live else f"needs {counted(round(bid), 'tick')}"

    def _resolved(self, line: records.Resolved) -> str:
        text = f"{line.robot} at {self._at(line.at)} resolves {self.obstacle(line.obstacle)}"
        if len(self.actions.get(line.obstacle, ())) < 2:  # else the previous line names them
            text += self._with(line)
        if line.traversable is not None:
            text += ", which is traversable" if line.traversable else ", which is not traversable"
        return text if line.requested else text + " (without a request)"

    def _with(self, line: records.Part | records.Resolved) -> str:
        """Return the other participants of an action in words, or an empty text."""
        others = [name for name in line.robots or () if name != line.robot]
        return f" with {self._all(others)}" if others else ""

    def _at(self, region: Region) -> str:
        return self.place(self.map, region)

    def _all(self, names: Iterable[str]) -> str:
        team = len(self.skills)
        if isinstance(names, frozenset):
            if len(names) == team > _LISTED_ROBOTS:
                return f"all {team} robots"
            names = [name for name in self.skills if name in names]
        return some(names)


def scheduled_words(clock: Clock, at: int) -> str:
    """Return a scenario's time in words: ``tick 12``, ``12 s``."""
    return f"{at} s" if clock is Clock.LIVE else f"tick {at}"


def synthesis_words(line: records.Synthesis) -> str:
    """Return the result of a synthesis in words: ``21 states in 3 ms, verified``."""
    found = line.verdict.value
    if line.verdict is Verdict.REALIZABLE and line.states is not None:
        found = counted(line.states, "state")
    spent = ", from the cache" if line.cached else f" in {seconds_words(line.seconds)}"
    proof = {None: "", True: ", verified", False: ", verification failed"}[line.verified]
    return f"{found}{spent}{proof}"
