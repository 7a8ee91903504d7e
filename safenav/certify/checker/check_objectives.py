"""A robot's objective in the header of a trace: its targets, rules and wording."""

from __future__ import annotations

import re
from collections.abc import Iterable
from math import prod
from typing import Any

from safenav.audit.kinds import ALTERNATION, shape_of
from safenav.audit.language import Clause, Pose, complete, named, read_clause, require
from safenav.audit.lines import read_objective
from safenav.audit.world import World
from safenav.certify.checker.check_strategies import Json

MOST_MEMORY = 64
STRICTLY = ", without crossing a target out of turn"


LOOSELY = "; it may cross a target out of turn"


class Objective:
    """A robot's objective: ``targets``, sets of regions any of which counts, or formulas.
    ``goals``: numbers of its goals; ``ranges``: the values of its memory and inputs, now and next.
    """

    def __init__(self, data: Json) -> None:
        told = read_objective(data)
        self.kind, self.targets = told.kind, [*told.targets]
        self.avoid, self.always = told.avoid, told.always
        self.data, self.shape = data, shape_of(self.kind)
        known = self.shape.known or self.kind == "ltl"
        require(known, f"objectives of the kind {self.kind} are not known here")
        readable = "ltl" in data or self.shape.one or isinstance(data[self.kind], list)
        require(readable, f"a {self.kind} without targets")
        own: Json = data["ltl"] if self.kind == "ltl" else {}
        memory: Json = own.get("memory", {})
        self.inputs = [*own.get("inputs", ())]  # environment inputs that its formulas name
        bits = (name for name, given in memory.items() if given == "bool")
        truths = frozenset((*bits, *self.inputs))
        texts = (own.get(part, ()) for part in ("init", "safety", "liveness"))
        listed = ([t] if isinstance(t, str) else t for t in texts)
        parts = ([read_clause(text, truths) for text in part] for part in listed)
        self.init, self.safety, self.liveness = parts
        steps = (f"region' = region | ({text})" for text in self.always)
        self.safety += [read_clause(text, truths) for text in steps]
        count = len(self.targets) or len(self.liveness) or 1
        self.goals = frozenset(range(count - 1 if self.shape.settles else 0, count))
        once = self.shape.ends and count > 1 and self.targets[-1] & self.targets[-2]
        require(not once, "the last two targets share a region")
        bounds = {name: (0, 1) if given == "bool" else given for name, given in memory.items()}
        self.memory = {name: range(least, most + 1) for name, (least, most) in bounds.items()}
        both = self.memory | dict.fromkeys(self.inputs, range(2))
        self.ranges = both | {f"{name}'": values for name, values in both.items()}

    def serves(self, wanted: Objective) -> bool:
        """Return whether this is the wanted objective, or requires the same targets in turn."""
        weaker = {} if "form" in wanted.data else wanted.alternating()
        return self.data in (wanted.data, weaker)

    def alternating(self) -> Json:
        """Return the data of its weaker form, with the same targets and rules."""
        weaker = {self.kind: ALTERNATION} if self.shape.strict else {}
        return {weaker.get(key, key): value for key, value in self.data.items()}

    def rules(self) -> tuple[Any, ...]:
        """Return its safety rules: the regions that it avoids, and ``always``."""
        return self.avoid, self.always

    def formed(self, form: str | None) -> Objective:
        """Return the objective that a strategy synthesized in this form pursues."""
        if not self.shape.strict or form != "alternation":
            return self
        found = f"a {self.kind} with 'form: literal' is made an alternation"
        require("form" not in self.data, found)
        return Objective(self.alternating())

    def words(self, world: World, form: str = "literal") -> str:
        """Return the objective as a sentence without its subject. ``form``: the weakest proven
        form, empty if there is none."""
        never = ", ".join(world.word([region]) for region in sorted(self.avoid))
        rest = f"; never enter {never}" if never else ""
        return self._aims(world, form) + rest + "".join(f"; always {text}" for text in self.always)

    def proven(self, robot: str, world: World, claims: Iterable[Json]) -> str:
        """Return the objective in the wording of the claim about its proven form."""
        forms = [self.words(world, form) for form in ("literal", "alternation", "")]
        texts = (re.sub(r"^Tick \d+: ", "", claim["text"]) for claim in claims)
        found = (words for text in texts for words in forms if text == f"{robot}: {words}.")
        return next(found, forms[-1])

    def _aims(self, world: World, form: str) -> str:
        if self.kind == "ltl":
            return "satisfy the formulas of its own objective"
        listed = [world.word(target) for target in self.targets]
        if self.shape.one:
            return f"go to {listed[0]} and stay"
        if self.shape.ends:
            return f"be at {', '.join(listed)} once, in this order, and stay at the last"
        if self.shape.covers:
            return f"be at each of {', '.join(listed)} infinitely often, in any order"
        turns = " in turn" if len(listed) > 1 else ""
        how = {"literal": STRICTLY, "alternation": LOOSELY}.get(form, "") * self.shape.strict
        return f"be at {' and '.join(listed)}{turns}, infinitely often{how}"

    def permits(self, before: Pose, after: Pose) -> bool:
        """Return whether a step satisfies its formulas and enters no region that it avoids."""
        return after[0] not in self.avoid and self.allows(self.safety, before, after)

    def allows(self, lines: Iterable[Clause], before: Pose, after: Pose) -> bool:
        """Return whether formulas hold at a step for some memory. If the memory has more than
        MOST_MEMORY values, formulas that read it are skipped."""
        known, few = named(before, after), prod(map(len, self.memory.values())) <= MOST_MEMORY
        asked = [line for line in lines if few or line.reads <= known.keys()]
        wanted = sorted(set().union(*(line.reads for line in asked)) - known.keys())
        return bool(complete(self.ranges, wanted, asked, known))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Objective) and self.data == other.data
