"""Scenarios of which a run once went wrong, or that show a behaviour, each with its facts.

The first comment of a file is its story. Its lines ``#:`` are YAML:

- ``TYPE``: fields of all lines of this type, in their order; ``a.b`` is the field b of the field
  a, and ``...WORDS`` are words of a text
- ``some TYPE``, ``no TYPE``, ``3 TYPE``: fields of lines that the trace has, does not have, or has
  so often
- ``in order``: the first lines with these fields, ``[TYPE, FIELDS]``, come in this order
- ``explained``, ``left_open``: words of the outcome's explanation, and the orders left open there
- ``story``, ``no story``, ``check``, ``no check``: words that the story of the run has or has not,
  and that ``safenav check`` prints or does not print
- ``notes``: words of the claims that the audit could not judge
- ``certified``: a bundle of the run is accepted, with these words
- ``damaged``: the audit refuses the trace without a ``line`` (``[TYPE, FIELDS, INDEX]``), with
  other ``fields`` of it or without one (``drop``), ``and`` more of these: the words ``found``, the
  broken ``rule``
- ``forged``: likewise, the checker of bundles does not accept the bundle with the damaged trace
- ``cut``: from before each pass on, resumed, the run has the same ``outcome``, or even the same
  ``moves``
- ``waits``: an operator attends the live run, and intervenes with these words at each wait;
  ``says``: with which it intervenes after a tick or pass, or with the data of a page;
  ``refused WORDS > WHY`` is impossible, or data with the reason ``refused``
- ``world``: in which it is played (``facts.WORLDS``); ``slides``, ``jams``, ``looks``, ``faults``,
  ``speeds``: what goes wrong there (``worlds.py``); ``there``: words of the scenario with others,
  with which the world differs from it; ``failures``: the policy for them; ``lies``: the world may
  tell what breaks rules
- ``refused``: the scenario is not loaded; words of the message
- ``clocks``: it is played on each of these
- ``or``: it is also played with these words replaced
- ``but``: it is also played with the words ``with`` replaced (default: none), where other
  facts hold; ``clocks``

Unless it has another ``outcome``, the mission is completed. Each trace must pass the audit. An
exhaustive search over joint states, which shares no code with safenav, has decided what the teams
of ``orders`` can do.
"""

from collections.abc import Iterator
from typing import Any

import pytest

from runtime.facts import CASES, Facts, hold, read_case


def cases() -> Iterator[Any]:
    for file in sorted(CASES.rglob("*.yaml")):
        text, said = read_case(file)
        clocks, others = said.pop("clocks", [""]), said.pop("but", [])
        variants = [(change, clocks, said) for change in [{}, *said.pop("or", [])]]
        variants += [(each.pop("with", {}), each.pop("clocks", clocks), each) for each in others]
        for change, played, facts in variants:
            for clock in played:
                changed = f"{text}clock: {clock}\n" if clock else text
                for was, now in change.items():
                    assert was in changed, (file, was)
                    changed = changed.replace(was, now)
                name = " ".join(filter(None, [file.stem, clock, *change.values()]))
                yield pytest.param(changed, facts, id=name)


@pytest.mark.parametrize(("text", "facts"), [*cases()])
def test_case(text: str, facts: Facts) -> None:
    hold(text, facts)
