"""The inputs of the environment during a run: their values, and the objectives that they select."""

from __future__ import annotations

from collections.abc import Iterator

from msgspec import Struct, field

from safenav.runtime.progress import Progress
from safenav.runtime.team import RobotState, TeamState
from safenav.runtime.worlds.adapter import inputs_of
from safenav.runtime.worlds.world import InputWorld
from safenav.scenario.objective import Objective
from safenav.spec.objective import NO_MEMORY
from safenav.trace import records


class EnvironmentInputs(Struct):
    """The inputs, set by ``world`` (None: by no world) and by a user."""

    state: TeamState
    world: InputWorld | None
    _by_user: dict[str, bool] = field(default_factory=dict)
    _recorded: frozenset[str] = frozenset()  # inputs set by a user, as last recorded
    _looked: int = -1

    @property
    def values(self) -> dict[str, bool]:
        """The present value of each input."""
        state = self.state
        values = inputs_of(self.world if state.inputs else None, int(state.time)) | self._by_user
        return {name: values.get(name, on) for name, on in state.inputs.items()}

    @property
    def changed(self) -> bool:
        """Whether an input has changed since the last reading."""
        return self.values != self.state.inputs

    def set(self, name: str, on: bool) -> None:
        """Set an input for a user."""
        self._by_user[name] = on

    def read(self) -> None:
        """Read the inputs of this tick; record a change once, also after a wait."""
        state, values = self.state, self.values
        if self._looked != state.tick:
            self._looked, state.inputs_before = state.tick, state.inputs
        if values != state.inputs or self._by_user.keys() != self._recorded:
            state.inputs, self._recorded = values, frozenset(self._by_user)
            state.emit(records.Inputs(state.tick, values, tuple(self._by_user) or None))

    def selected(self) -> Iterator[tuple[RobotState, Objective, int | None, Progress]]:
        """Yield the robots for which the inputs select another objective than before, with that
        objective, its deadline and its progress."""
        for robot in self.state.robots.values():
            on = [name for name, _ in robot.robot.when if self.state.inputs[name]]
            mode = on[0] if on else None
            if mode == robot.mode:
                continue
            former = robot.base or (robot.robot.objective, robot.own, robot.robot.within)
            robot.mode, robot.base = mode, None if mode is None else former
            base, before, within = former
            given = base if mode is None else dict(robot.robot.when)[mode]
            own = Progress(given, before.memory if mode is None else NO_MEMORY)
            yield robot, given, within if mode is None else None, own
