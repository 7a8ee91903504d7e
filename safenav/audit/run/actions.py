"""Effects of the robots' actions on obstacles: needs met and loads taken."""

from __future__ import annotations

from collections.abc import Mapping

from safenav.audit.lines import Line
from safenav.audit.run.state import State

WITHOUT_EFFECT = ("failed", "nothing")


class Actions(State):
    """The state, with the actions that change its obstacles. Only ``situation`` performs them."""

    def perform(self, robot: str, results: Mapping[str, str], act: Line | None = None) -> None:
        """Apply the robot's action where it stands: its part in the next needs, except where the
        result names no effect. A failed action has only the effects that it names. After a met need
        the next one applies. Loads are taken last, by type, region and number; in a live run, those
        of the ``act``."""
        failed, found = "failed" in results.values(), list[str]()
        for name, obstacle in self.obstacles.items():
            if results.get(name, "failed" if failed else None) in WITHOUT_EFFECT:
                continue
            if act is not None and name not in results and self.resolves_alone(name):
                continue  # it may have appeared after the action began
            # Needs of an obstacle that the scenario does not list count from its discovery.
            counted = name in self.introduced or len(obstacle.all_needs) == 1
            if counted and self.status[name].unmet:
                found.append(name)
        for name in found:
            self.perform_at(robot, name, put_down=True)
        for name in sorted(
            (n for n in found if self.open[n].takes()), key=lambda name: self.open[name].order
        ):
            # Robots choose whether to take a load as a whole; the line ``met`` records that.
            whole = self.need(name).robots == 1 or self.need(name).together
            asked = act is None or name in act.obstacles
            if not whole and name in self.requests and asked:
                self.perform_at(robot, name)

    def take(self, record: Line) -> None:
        """Apply the taking of a load as a whole, and the robot's further actions on it there."""
        name, stage = record.obstacle, record.need
        if name not in self.open or self.open[name].stage != stage or not self.open[name].takes():
            return
        group = self.takers(record.robot, name)
        if group is not None:
            self._meet(name, group)
            self.perform_at(record.robot, name, put_down=True)

    def perform_at(self, robot: str, name: str, *, put_down: bool = False) -> None:
        """Apply the robot's part in the next needs of one obstacle. ``put_down``: it takes no
        load."""
        while robot in self.standing(name) and not (put_down and self.open[name].takes()):
            done = self.open[name].done | {robot}
            self.open[name] = self.open[name]._replace(done=done)
            need = self.need(name)
            group = frozenset(self.standing(name)) if need.together else done
            if len(group) < need.robots or not self._meet(name, group):
                return

    def _meet(self, name: str, group: frozenset[str]) -> bool:
        """Record that a group meets the next need of an obstacle; return whether another need
        follows."""
        one = self.open[name]
        self.turn.met[name, one.stage] = group
        if len(one.left) == 1:
            return False
        self.open[name] = one._replace(done=frozenset()).advanced(group)
        self.turn.advanced.add(name)
        return True
