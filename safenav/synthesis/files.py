"""Files for and from other tools: specifications in slugsin and structured slugs; a strategy as a
networkx graph, GraphML, DOT, and its size in figures.

Values are written in words (``region=47 heading=east scout``), nodes and edges come in the
order of the automaton: the same strategy always gives the same bytes.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from safenav.errors import Diagnostic, InputError
from safenav.files import another_kind, read_file
from safenav.spec.specification import Owner, Section, Specification, Variable, read_specification
from safenav.synthesis.program import Finished, ProcessGroup, find_own_binary
from safenav.synthesis.slugs import ExitStatus, SynthesisResult
from safenav.synthesis.strategy import Strategy, bit_names
from safenav.world.map import Heading

if TYPE_CHECKING:
    import networkx


_ERROR = re.compile(r"-:(\d+):(\d+): error: (.*)")
_HINT = re.compile(r"\s*hint: (.*)")
MOST_OF_A_TEXT = 20_000_000
"""Bytes."""
_SECONDS = 60.0


def load_specification(path: Path) -> Specification:
    """Return the specification in a file. Raises InputError as ``specification_in`` does."""
    try:
        data = read_file(path, MOST_OF_A_TEXT)
    except OSError as error:
        raise InputError([Diagnostic(str(path), 0, 0, error.strerror or str(error))]) from error
    return specification_in(data, str(path), path.stem)


def specification_in(data: bytes, file: str, robot: str) -> Specification:
    """Return the specification that a file holds.

    Raises InputError with all errors that safenav's synthesizer finds in its text.
    """
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError([Diagnostic(file, 0, 0, "not valid UTF-8 text")]) from error
    if wrong := another_kind(text, "specification", file):
        raise InputError([Diagnostic(file, 0, 0, *wrong)])
    done = _translated(data)
    if done is not None and done.status == ExitStatus.BAD_INPUT:
        raise InputError(_diagnostics(done.stderr.decode("utf-8", "replace"), file, text))
    return read_specification(text, file, robot)


def slugsin_of(spec: Specification) -> bytes | None:
    """Return a specification in slugsin, as safenav's own slugs translates it; None without it."""
    done = _translated(spec.to_structuredslugs().encode())
    return done.stdout if done is not None and done.status == ExitStatus.REALIZABLE else None


def _translated(data: bytes) -> Finished | None:
    own = find_own_binary()
    if own is None:
        return None
    translate = [str(own.path), "--translate", "-"]
    return ProcessGroup().run(translate, data, _SECONDS, own=own.ours)


def _diagnostics(output: str, file: str, text: str) -> list[Diagnostic]:
    """Errors as the synthesizer wrote them on standard error."""
    found: list[Diagnostic] = []
    lines = text.split("\n")
    hint = ""
    for line in reversed(output.splitlines()):  # a hint follows its error
        if error := _ERROR.fullmatch(line):
            row = int(error[1])
            source = lines[row - 1] if 0 < row <= len(lines) else ""
            found.append(Diagnostic(file, row, int(error[2]), error[3], hint, source))
            hint = ""
        elif hinted := _HINT.fullmatch(line):
            hint = hinted[1]
    return found[::-1] or [Diagnostic(file, 0, 0, output.strip() or "not a specification")]


_NOT_XML = "[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]"  # compiled on use: that is slow


def to_dot(strategy: Strategy) -> str:
    """Return the automaton in Graphviz's language. Initial nodes have a double border."""
    spec = strategy.specification
    initial = frozenset(strategy.initial())
    lines = [f"digraph {_quoted(spec.robot)} {{", f"  label={_quoted(spec.title)};"]
    lines += ["  rankdir=LR;", "  node [shape=box, style=rounded];"]
    for node, values in _decoded(strategy):
        label = f"{node}: goal {strategy.ranks[node]}"
        for owner in (Owner.OUTPUT, Owner.INPUT):
            words = in_words(strategy, values, owner)
            label += f"\n{words}" if words else ""
        border = ", peripheries=2" if node in initial else ""
        lines.append(f"  {node} [label={_quoted(label)}{border}];")
    for node, successors in enumerate(strategy.transitions):
        lines += [f"  {node} -> {successor};" for successor in successors]
    return "\n".join(lines) + "\n}\n"


def to_graphml(strategy: Strategy) -> str:
    """Return the automaton as GraphML, with every variable as a number on the nodes."""
    import networkx

    return "\n".join(networkx.generate_graphml(to_networkx(strategy))) + "\n"


def to_networkx(strategy: Strategy) -> networkx.DiGraph[int]:
    """Return the automaton as a directed graph. Nodes carry ``label``, ``goal``, ``initial`` and a
    number for each variable (``value_`` before its name), edges their ``inputs``."""
    # Imported here: it takes longer than most syntheses.
    import networkx

    spec = strategy.specification
    initial = frozenset(strategy.initial())
    graph: networkx.DiGraph[int] = networkx.DiGraph()
    graph.graph["robot"] = spec.robot
    graph.graph["title"] = re.sub(_NOT_XML, "?", spec.title)
    inputs = []
    for node, values in _decoded(strategy):
        words = [in_words(strategy, values, owner) for owner in (Owner.OUTPUT, Owner.INPUT)]
        inputs.append(words[1])
        graph.add_node(
            node,
            label=" ".join(filter(None, words)),
            goal=strategy.ranks[node],
            initial=node in initial,
            **{f"value_{name}": value for name, value in values.items()},
        )
    for node, successors in enumerate(strategy.transitions):
        for successor in successors:
            graph.add_edge(node, successor, inputs=inputs[successor])
    return graph


def in_words(strategy: Strategy, values: Mapping[str, int], owner: Owner) -> str:
    """Return the values of the inputs or of the outputs in words."""
    owned = strategy.specification.owned(owner)
    return " ".join(_value_in_words(variable, values[variable.name]) for variable in owned)


def size_of(spec: Specification, result: SynthesisResult) -> dict[str, Any]:
    """Return the figures of one synthesis as data: ``goals`` of the specification, ``bits`` of a
    state, ``seconds`` that the synthesizer took; None where there is no strategy."""
    strategy = result.strategy
    return {
        "verdict": result.verdict.value,
        "states": None if strategy is None else len(strategy.states),
        "edges": None if strategy is None else strategy.edges,
        "goals": max(1, len(spec.section(Section.SYS_LIVENESS))),
        "variables": len(spec.variables),
        "bits": sum(len(bit_names(variable)) for variable in spec.variables),
        "seconds": result.seconds,
    }


def _value_in_words(variable: Variable, value: int) -> str:
    if variable.bounds is None:
        return variable.name if value else f"!{variable.name}"
    if variable.bounds == (0, len(Heading) - 1) and variable.name.endswith("heading"):
        return f"{variable.name}={Heading(value).label}"
    return f"{variable.name}={value}"


def _decoded(strategy: Strategy) -> Iterator[tuple[int, dict[str, int]]]:
    return ((node, strategy.values(node)) for node in range(len(strategy.states)))


def _quoted(text: str) -> str:
    escaped = (
        re.sub(_NOT_XML, "?", text).replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    )
    return f'"{escaped}"'
