"""A brute-force GR(1) solver on explicit states: the judge of slugs/ in tests, never fast.

`build_game` evaluates a specification on every transition, `solve` runs the textbook fixpoint,
`extract` gives the one strategy that compatibility with SLUGS fixes to the byte, `check_strategy`
and `check_counterstrategy` model check any automaton, from any program, and share nothing with the
fixpoint: they judge the judge.
"""

from oracle.automaton import Automaton, from_json, to_json, to_text
from oracle.checker import check_counterstrategy, check_strategy
from oracle.fixpoint import extract, is_realizable, solve
from oracle.game import Game, build_game
from oracle.generator import random_specification
from oracle.rendering import inputs_first, to_structuredslugs
from oracle.slugsin import read_slugsin
from oracle.specification import Specification

__all__ = [
    "Automaton",
    "Game",
    "Specification",
    "build_game",
    "check_counterstrategy",
    "check_strategy",
    "extract",
    "from_json",
    "inputs_first",
    "is_realizable",
    "random_specification",
    "read_slugsin",
    "solve",
    "to_json",
    "to_structuredslugs",
    "to_text",
]
