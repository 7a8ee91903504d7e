"""The structured-slugs expression language: syntax tree, parser, printer, checks, evaluator."""

from safenav.formula.checking import Problem, check
from safenav.formula.evaluator import evaluate
from safenav.formula.parser import FormulaError, parse
from safenav.formula.printer import to_text
from safenav.formula.syntax import (
    RESERVED_WORDS,
    And,
    Comparison,
    Constant,
    Formula,
    Iff,
    Implies,
    Name,
    Next,
    Not,
    Number,
    Or,
    Relation,
    Sum,
    Term,
    Xor,
    names_of,
    resolve_constants,
    variables,
)

__all__ = [
    "RESERVED_WORDS",
    "And",
    "Comparison",
    "Constant",
    "Formula",
    "FormulaError",
    "Iff",
    "Implies",
    "Name",
    "Next",
    "Not",
    "Number",
    "Or",
    "Problem",
    "Relation",
    "Sum",
    "Term",
    "Xor",
    "check",
    "evaluate",
    "names_of",
    "parse",
    "resolve_constants",
    "to_text",
    "variables",
]
