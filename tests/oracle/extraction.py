"""The explicit strategy that SLUGS prints, node for node.

For (state, input, goal): the transition set recorded first that covers the state and input, and
among its outputs the lexicographically smallest.  Breadth first from all initial states.
"""

from oracle.automaton import Automaton, Node
from oracle.fixpoint import Solution, initial_states
from oracle.game import StateSet, members


def extract(solution: Solution) -> Automaton:
    """The strategy of a realizable game."""
    game = solution.game
    numbers: dict[tuple[int, int], int] = {}
    queue: list[tuple[int, int]] = []

    def number(state: int, rank: int) -> int:
        if (state, rank) not in numbers:
            numbers[state, rank] = len(queue)
            queue.append((state, rank))
        return numbers[state, rank]

    for state in members(initial_states(game) & solution.winning):
        number(state, 0)
    nodes = []
    for state, goal in queue:  # grows while it is walked
        chosen = sorted(
            _choose(solution, goal, state, answers) for answers in game.moves[state].values()
        )
        successors = tuple(number(t, advance(solution, goal, state, t)) for t in chosen)
        nodes.append(Node(state, goal, successors))
    return Automaton(game.specification.bits, tuple(nodes))


def advance(solution: Solution, goal: int, state: int, successor: int) -> int:
    """The next goal: past every goal in turn that this very transition satisfies."""
    guarantees = solution.game.guarantees
    for _ in range(len(guarantees)):
        if not guarantees[goal][state] >> successor & 1:
            break
        goal = (goal + 1) % len(guarantees)
    return goal


def _choose(solution: Solution, goal: int, state: int, answers: StateSet) -> int:
    for transitions in solution.recorded[goal]:
        covered = answers & solution.allowed(goal, transitions, state)
        if covered:
            return (covered & -covered).bit_length() - 1
    raise AssertionError(f"state {state} is called winning but has no move towards goal {goal}")
