"""Typed reading of YAML documents by their language's declarations (``keys``).

``read`` returns the value of a node, or None after a reported error. It continues after errors, so
one error does not hide another.
"""

import math
import re
import types
from collections.abc import Callable, Collection, Mapping
from enum import StrEnum
from functools import partial
from types import MappingProxyType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from msgspec import Struct

from safenav.scenario.yaml import document
from safenav.scenario.yaml.document import Node, Scalar, Sequence, clipped, is_nothing, one_of
from safenav.scenario.yaml.findings import Findings, as_meant, listed, suggestion, wrong_type
from safenav.scenario.yaml.keys import Beside, Item, Key, OneOf, Part, Raw, entries, key_of

Stages = Mapping[str, Callable[[Any, Node | None, Any], None]]
"""Keys of a mapping whose values are read first, in this order, each with a function that takes the
value, its node (None: missing) and the findings before the next value is read."""


def read(
    annotation: Any,
    node: Node | None,
    what: str,
    findings: Findings,
    key: Key | None = None,
    stages: Stages = MappingProxyType({}),
    name: str = "",
) -> Any:
    """Return the value of a node; None without a node or after a reported error. ``what`` names the
    node in messages; ``key`` describes it; ``stages``: the stages of a class; ``name``: the node's
    key in the mapping that contains it."""
    if node is None:
        return None
    origin, arguments = get_origin(annotation), get_args(annotation)
    key = key_of(annotation, key) if origin is Annotated or key is None else key
    if origin is Annotated:
        if key.by:
            value = getattr(findings, key.by)(node, what)
        else:
            value = read(_inner(annotation), node, what, findings, key)
        for each in arguments[1:]:
            if isinstance(each, Key) and each.check is not None and value is not None:
                value = each.check(value, node, what, findings)
        return value
    if origin in (Union, types.UnionType):
        return _union([a for a in arguments if a is not types.NoneType], node, what, findings, key)
    if origin is tuple:
        if arguments[-1] is Ellipsis:
            return _list(arguments[0], node, what, findings, key)
        return _pair(arguments, node, what, findings, key)
    if origin is frozenset:
        items = _list(arguments[0], node, what, findings, key)
        return None if items is None else frozenset(items)
    if origin is dict:
        return _mapping(arguments, node, what, findings, key)
    if origin is Literal:
        return _choice({str(a): a for a in arguments}, node, what, findings, key.why)
    if annotation in _PLAIN:
        return _PLAIN[annotation](node, what, findings, key)
    if issubclass(annotation, Raw):
        return annotation(node, what)
    if issubclass(annotation, Part):
        return _item(annotation, node, what, findings, key, stages, name)
    assert issubclass(annotation, StrEnum)
    known = {member.value: member for member in annotation if member not in key.without}
    return _choice(known, node, what, findings, key.why)


def _inner(annotation: Any) -> Any:
    """Return the annotation of a value in the document: the key's form or its class."""
    key, kind = key_of(annotation), get_args(annotation)[0]
    return kind if key.by or key.form is None or kind is Raw else key.form


def _item(
    kind: type[Part], node: Node, what: str, findings: Findings, own: Key, stages: Stages, name: str
) -> Any:
    if not isinstance(node, document.Mapping) or node == document.reported(node):
        hint = f"for example {kind.example}" if kind.example else ""
        wrong_type(node, what, "a mapping (key: value)", findings, hint)
        return None
    known = {word: key for word, key in entries(kind).items() if word not in own.without}
    before = len(findings)
    meant = set[str]()
    if not kind.open:
        node, meant = as_meant(node, what, known, kind.elsewhere, findings)
    of, inside = _filled(kind.label, what, node), {key.text: inner for key, inner in node.entries}
    # unknown keys excuse missing ones, except in a wrong file
    told = inside and inside.keys().isdisjoint(known) and not kind.title
    for word, key in known.items():  # in the order of the class's fields, not the stages
        if key.required and word not in inside and word not in meant and not told:
            findings.add(node, f"{what}: the key '{word}' is missing", key.hint)
    values: dict[str, Any] = {}
    for word in (*stages, *(each for each in known if each in inside and each not in stages)):
        key, inner, value = known[word], inside.get(word), None
        if inner is not None:
            title = f"{word if isinstance(inner, document.Mapping) else repr(word)} {of}".rstrip()
            value = read(key.annotation, inner, title, findings, key)
            if value is not None and key.check is not None:
                value = key.check(value, inner, title, findings)
        if value is not None:
            values[key.field] = value
        if word in stages:
            stages[word](value, inner, findings)
    _check_rules(kind.rules, node, what, known, findings)
    if issubclass(kind, Item):
        return kind(node=node, of=of, flawed=len(findings) > before, **values)
    for key in known.values():
        if key.like in values:
            values.setdefault(key.field, values[key.like])
    given = {each.field for each in known.values() if each.required}
    if len(findings) > before or not given <= values.keys():
        return None
    item = kind(**({"name": name} if "name" in kind.__struct_fields__ else {}), **values)
    for word, found, hint in item.flaws():
        findings.add(node.get(word) or node, f"'{word}' {of}{found}", hint)
    return item if len(findings) == before else None


def _check_rules(
    rules: tuple[OneOf | Beside, ...],
    node: document.Mapping,
    what: str,
    known: Collection[str],
    findings: Findings,
) -> None:
    """Report keys that are missing or have no meaning beside the other keys, each once. A missing
    key may be a misspelt one that was already reported."""
    given = {key.text: key for key, _ in node.entries}
    told = {word for word in given if word not in known}
    for rule in rules:
        if isinstance(rule, Beside):
            alone = rule.key in given.keys() - told and given.keys().isdisjoint(rule.others)
            if alone and rule.hint:
                told.add(rule.key)
                others = one_of(rule.others, "'")
                findings.add(given[rule.key], f"{what}: '{rule.key}' without {others}", rule.hint)
            continue
        found = [given[word] for word in given if word in rule.keys]
        for key in found[1:] if rule.several else ():
            findings.add(key, f"{what}: both '{found[0].text}' and '{key.text}'", rule.several)
        if not found and not told:
            findings.add(node, f"{what}: one of {listed(rule.keys)} is missing", rule.missing)
        if not found:
            return


def _filled(form: str, what: str, node: Node | None = None, name: str = "") -> str:
    """Return ``form`` with its fields filled: a name for messages."""
    words = {"what": what, "rest": what.partition(" ")[2], "name": name}
    for field in re.findall(r"{(\w+)}", form):
        if field not in words:
            value = document.below(node, field)
            text = value.value if isinstance(value, Scalar) else None
            unknown = f"a {field}" if name else what
            words[field] = clipped(text) if isinstance(text, str) and text else unknown
    return form.format(**words)


def _list(inner: Any, node: Node, what: str, findings: Findings, key: Key) -> Any:
    items = sequence(node, what, findings)
    if items is None:
        return None
    if len(items) < key.entries:
        least = f"{what} is empty" if not items else f"{what}: at least {key.entries} are needed"
        findings.add(node, least, key.why)
    of, one = key_of(inner), getattr(inner, "one", Item.one)
    one = one if of.form is None and not of.by else "{what}"
    outer = findings.within
    findings.within = node if isinstance(node, Sequence) else None
    found = [
        read(inner, item, _filled(one, what, item, str(number)), findings)
        for number, item in enumerate(items, 1)
    ]
    findings.within = outer
    return tuple(value for value in found if value is not None)


def sequence(node: Node, what: str, findings: Findings) -> tuple[Node, ...] | None:
    """Return the items of a list. For another node, report an error and return None."""
    if isinstance(node, Sequence):
        return node.items
    shown = clipped(node.text) if isinstance(node, Scalar) else ""
    shown = f'"{shown}"' if "(" in shown else shown  # commas of a formula end no item
    if isinstance(node, document.Mapping) and all(is_nothing(value) for _, value in node.entries):
        shown = clipped(", ".join(key.text for key, _ in node.entries))
    hint = f"put brackets around it: [{shown}]" if shown else "begin each item with '- '"
    if shown in ("none", "nothing", "no", "null", "~"):
        hint = "for none, write []"
    wrong_type(node, what, "a list [...]", findings, hint)
    return None


def _pair(inner: tuple[Any, ...], node: Node, what: str, findings: Findings, key: Key) -> Any:
    if not isinstance(node, Sequence) or len(node.items) != len(inner):
        wrong_type(node, what, key.expected or f"a list of {len(inner)}", findings)
        return None
    items = zip(inner, node.items, strict=True)
    found = tuple(read(each, item, f"an item of {what}", findings) for each, item in items)
    return None if None in found else found


def _mapping(inner: tuple[Any, ...], node: Node, what: str, findings: Findings, key: Key) -> Any:
    if not isinstance(node, document.Mapping):
        hint = f"for example {key.example}" if key.example else ""
        wrong_type(node, what, "a mapping (key: value)", findings, hint)
        return None
    one = getattr(inner[1], "one", "'{name}' of {what}")
    found = {}
    for name, item in _indented(node, inner[1], what, findings):
        label = _filled(one, what, name=clipped(name.text))
        value = read(inner[1], item, label, findings, name=name.text)
        known = read(inner[0], name, what, findings)
        if value is not None and known is not None:
            found[known] = value
    return found


def _indented(
    node: document.Mapping, kind: Any, what: str, findings: Findings
) -> list[document.Entry]:
    """Return the entries of a mapping of items. Move keys that belong in the previous item there,
    and report the first one."""
    known = entries(kind) if isinstance(kind, type) and issubclass(kind, Part) else {}
    found, told = list[document.Entry](), ""
    for key, value in node.entries:
        inside = [inner.text for inner, _ in document.entries_of(value)]
        is_item = known.keys() & inside or (isinstance(value, document.Mapping) and not inside)
        name, item = found[-1] if found else (key, value)
        if key.text not in known or is_item or not found or isinstance(item, Sequence):
            found.append((key, value))
            continue
        if name.text != told:
            hint = f"if it belongs to '{clipped(name.text)}', indent it"
            findings.add(key, f"{what}: '{key.text}' is a key, not the name of an item", hint)
        told = name.text
        found[-1] = name, document.Mapping(item.place, (*document.entries_of(item), (key, value)))
    return found


def _choice(
    known: Mapping[str, Any], node: Node, what: str, findings: Findings, why: str = ""
) -> Any:
    if not isinstance(node, Scalar) or not isinstance(node.value, str):
        wrong_type(node, what, f"one of {listed(known)}", findings)
        return None
    if node.value not in known:
        hint = "; ".join(filter(None, (suggestion(node.value, known), why)))
        findings.add(node, f"{what}: unknown word '{clipped(node.value)}'", hint)
    return known.get(node.value)


def _union(choices: list[Any], node: Node, what: str, findings: Findings, key: Key) -> Any:
    """Read a node by the first choice for its form: mapping, list, number or text."""
    fitting = [choice for choice in choices if _fits(choice, node)]
    if fitting or not key.expected:
        return read((*fitting, choices[-1])[0], node, what, findings, key)
    wrong_type(node, what, key.expected, findings)
    return None


def _fits(annotation: Any, node: Node) -> bool:
    origin = get_origin(annotation)
    if origin is Annotated:
        return _fits(_inner(annotation), node)
    if origin in (Union, types.UnionType):
        return any(_fits(choice, node) for choice in get_args(annotation))
    if origin is frozenset:  # regions
        return not isinstance(node, document.Mapping)
    if origin is tuple:
        arguments = get_args(annotation)
        any_length = arguments[-1] is Ellipsis
        return isinstance(node, Sequence) and (any_length or len(node.items) == len(arguments))
    if origin is dict:
        return isinstance(node, document.Mapping)
    if origin is Literal:
        return isinstance(node, Scalar) and node.value in get_args(annotation)
    if issubclass(annotation, Struct) and annotation is not Scalar:
        return isinstance(node, document.Mapping)
    value = node.value if isinstance(node, Scalar) else None
    if isinstance(value, bool):
        return annotation is bool
    kinds: Mapping[Any, Any] = {int: int, float: int | float, bool: bool}
    return isinstance(value, kinds.get(annotation, str))


def _number(node: Node, what: str, findings: Findings, key: Key, kind: Any = float) -> Any:
    value: Any = node.value if isinstance(node, Scalar) else None
    if isinstance(value, str) and value.lower().lstrip("+-") in ("nan", "inf"):
        value = float(value)  # spellings of other YAML writers: map_saver has '-nan'
    if isinstance(value, bool) or not isinstance(value, int | kind):
        default = "a whole number" if kind is int else "a number"
        wrong_type(node, what, key.expected or default, findings)
        return None
    if isinstance(value, float) and not math.isfinite(value):
        wrong_type(node, what, "a finite number", findings, key.why)
        return None
    least, most = key.range(kind)
    limits = f"at least {least:g}" if value < least else f"at most {most}" if value > most else ""
    if limits and kind is float and key.most is not None:
        limits = f"from {least:g} to {most:g}"
    if key.above is not None and value <= key.above:
        limits = f"more than {key.above:g}"
    if limits:
        shown = clipped(f"{value:g}" if isinstance(value, float) else str(value))
        findings.add(node, f"{what} is {shown}, and must be {limits}", key.why)
    return None if limits else kind(value)


def _text(node: Node, what: str, findings: Findings, key: Key) -> Any:
    if not isinstance(node, Scalar) or not isinstance(node.value, str):
        wrong_type(node, what, "a text", findings, key.why)
        return None
    if not node.value.strip():
        findings.add(node, f"{what} is empty")
        return None
    return node.value


def _truth(node: Node, what: str, findings: Findings, _: Key) -> Any:
    if not isinstance(node, Scalar) or not isinstance(node.value, bool):
        wrong_type(node, what, "true or false", findings)
        return None
    return node.value


_PLAIN: Mapping[Any, Callable[[Node, str, Findings, Key], Any]] = {
    int: partial(_number, kind=int),
    float: _number,
    str: _text,
    bool: _truth,
    Scalar: lambda node, what, findings, key: node if _text(node, what, findings, key) else None,
}
