"""Case files: missions that once ended in a finding, as scenarios with facts in their comments.

The first comment of a file is its story. Its lines ``#:`` are YAML: the ``faults`` of the world by
their chances, with the ``seed`` that they strike by; the words of an ``operator``, each with its
pass, and whether the run is ``attended``; the pass at which a ``kill`` cuts it off; the
``outcome``; ``blocking``: a world behind calls; ``open``: why a finding is known and not mended.
"""

import copy
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml

from campaigns.play import play
from once import from_yaml
from safenav.errors import InputError

Data = dict[str, Any]
OPTIONS = ("operator", "attended", "kill", "blocking")
KEYS = ("robots", "obstacles", "orders", "changes", "never_together", "inputs", "chargers", "flat")
KEYS += ("late", "coordination", "clock", "limits", "seed")


def read_case(file: Path) -> tuple[Data, dict[str, Any], dict[str, Any]]:
    """The mission of a file, the options of ``play``, and all facts."""
    text = file.read_text(encoding="utf-8")
    said = "\n".join(line[2:] for line in text.splitlines() if line.startswith("#:"))
    facts, data = from_yaml(said) or {}, from_yaml(text)
    facts["outcome"] = facts.get("outcome") or (data.get("expect") or {}).get("outcome")
    options = {k: v for k, v in facts.items() if k in OPTIONS}
    if "faults" in facts:
        options["faults"] = {k: v for k, v in facts["faults"].items() if k != "seed"}
        options["seed"] = facts["faults"]["seed"]
    return data, options, facts


def case_text(story: str, data: Data, options: Mapping[str, Any]) -> str:
    """A mission and its options as the text of a case file."""
    facts = {k: options[k] for k in OPTIONS if options.get(k)}
    if options.get("faults") is not None:
        facts["faults"] = {"seed": options["seed"], **options["faults"]}
    lines = [f"# {line}" for line in story.splitlines()]
    lines += [f"#: {name}: {_flow(value)}" for name, value in facts.items()]
    for key, value in data.items():
        inner = value.items() if isinstance(value, dict) and key in ("robots", "catalogue") else ()
        if not inner and not (isinstance(value, list) and value and isinstance(value[0], dict)):
            lines.append(f"{key}: {_flow(value)}")
            continue
        lines.append(f"{key}:")
        lines += [f"  {name}: {_flow(each)}" for name, each in inner]
        lines += [f"  - {_flow(each)}" for each in (value if not inner else ())]
    return "\n".join(lines) + "\n"


def _flow(value: Any) -> str:
    plain = yaml.safe_dump(value, default_flow_style=True, sort_keys=False, width=10**6)
    return plain.removesuffix("\n...\n").rstrip("\n")


def shrunk(data: Data, options: dict[str, Any], finding: str) -> tuple[Data, dict[str, Any]]:
    """A smaller mission with a finding of the same kind: without a robot, an obstacle, a key, a
    kind of fault, or a word of the operator, as long as one of them can go."""
    kind = finding.partition(":")[0]
    options = {**options, "certified": kind == "certify"}

    def fails(data: Data, options: dict[str, Any]) -> bool:
        try:
            found = play(data, **options).found
        except InputError:
            return False
        return bool(found) and found[0].startswith(kind)

    again = True
    while again:
        again = False
        for fewer in _fewer(data, options):
            if fails(*fewer):
                (data, options), again = fewer, True
                break
    return data, options


def _fewer(data: Data, options: dict[str, Any]) -> Iterator[tuple[Data, dict[str, Any]]]:
    for name in ("faults", "operator"):
        for each in options.get(name) or ():
            left: Any = copy.copy(options[name])
            left.pop(each) if name == "faults" else left.remove(each)
            yield data, {**options, name: left}
    for key in KEYS:
        value = data.get(key)
        places: Any = range(len(value)) if isinstance(value, list) else ()
        for each in value if isinstance(value, dict) else places:
            changed = copy.deepcopy(data)
            del changed[key][each]
            yield changed, options
        if key in data and key != "robots":
            yield {k: v for k, v in data.items() if k != key}, options
    for kind in ("robots", "catalogue"):
        for path in _keys(data.get(kind) or {}, 3 if kind == "catalogue" else 2):
            changed = copy.deepcopy(data)
            inner = changed[kind]
            for step in path[:-1]:
                inner = inner[step]
            del inner[path[-1]]
            yield changed, options


def _keys(data: Mapping[str, Any], depth: int) -> Iterator[tuple[str, ...]]:
    for key, value in data.items():
        if depth > 1 and isinstance(value, dict):
            yield from ((key, *rest) for rest in _keys(value, depth - 1))
        else:
            yield (key,)
