"""A robot's objective in the header of a trace: its targets, rules and wording."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

from safenav.audit.formulas import Texts
from safenav.audit.kinds import ALTERNATION, shape_of
from safenav.audit.language import require
from safenav.audit.lines import read_objective
from safenav.audit.world import World
from safenav.certify.checker.check_strategies import Json

STRICTLY = ", without crossing a target out of turn"


LOOSELY = "; it may cross a target out of turn"


class Objective:
    """A robot's objective: ``targets``, sets of regions any of which counts, or formulas.
    ``goals``: numbers of its goals; ``ranges``: the values of its memory and inputs, now and next.
    """

    def __init__(self, data: Json) -> None:
        read = read_objective(data)
        self.kind, self.targets = read.kind, [*read.targets]
        self.avoid, self.always = read.avoid, read.always
        self.data, self.shape = data, shape_of(self.kind)
        known = self.shape.known or self.kind == "ltl"
        require(known, f"objectives of the kind {self.kind} are not known here")
        readable = "ltl" in data or self.shape.one or isinstance(data[self.kind], list)
        require(readable, f"a {self.kind} without targets")
        own = Texts(data["ltl"] if self.kind == "ltl" else {}, self.always)
        self.init, self.safety, self.liveness = own.init, own.safety, own.liveness
        self.inputs, self.memory = [*own.inputs], own.memory
        count = len(self.targets) or len(self.liveness) or 1
        self.goals = frozenset(range(count - 1 if self.shape.settles else 0, count))
        once = self.shape.ends and count > 1 and self.targets[-1] & self.targets[-2]
        require(not once, "the last two targets share a region")
        both = own.memory | own.inputs
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

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Objective) and self.data == other.data
