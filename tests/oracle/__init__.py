"""A brute-force GR(1) solver on explicit states: the judge of slugs/ in tests, never fast.

`build_game` evaluates a specification on every transition, `solve` runs the textbook fixpoint,
`extract` gives the one strategy that compatibility with SLUGS fixes to the byte, `check_strategy`
and `check_counterstrategy` model check any automaton, from any program, and share nothing with the
fixpoint: they judge the judge.
"""

from oracle.automaton import Automaton, MalformedAutomatonError, Node, from_json, to_json, to_text
from oracle.checker import check_counterstrategy, check_strategy
from oracle.dense_games import dense_game
from oracle.extraction import extract
from oracle.fixpoint import Solution, initial_states, is_realizable, losing_inputs, solve
from oracle.game import Game, build_game, members
from oracle.generator import deep_formulas, random_specification
from oracle.independent_games import independent_game
from oracle.rendering import inputs_first, to_slugsin, to_structuredslugs
from oracle.slugsin import read_slugsin
from oracle.specification import Specification, Variable

__all__ = [
    "Automaton",
    "Game",
    "MalformedAutomatonError",
    "Node",
    "Solution",
    "Specification",
    "Variable",
    "build_game",
    "check_counterstrategy",
    "check_strategy",
    "deep_formulas",
    "dense_game",
    "extract",
    "from_json",
    "independent_game",
    "initial_states",
    "inputs_first",
    "is_realizable",
    "losing_inputs",
    "members",
    "random_specification",
    "read_slugsin",
    "solve",
    "to_json",
    "to_slugsin",
    "to_structuredslugs",
    "to_text",
]
