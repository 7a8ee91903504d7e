"""Prints measurements as a table: one line a case, one group of columns a binary."""

from collections.abc import Sequence
from dataclasses import dataclass

from measuring import Summary
from suites import Case

MEMORY_BAR = 256


@dataclass(frozen=True)
class Row:
    """One case, what each binary made of it, and how many nodes the strategy has, if counted."""

    case: Case
    results: dict[str, Summary]
    nodes: int | None


def render(rows: Sequence[Row], binaries: Sequence[str]) -> str:
    """The table as text; CPU seconds, quoted figures in brackets."""
    barred = any(row.case.bar is not None for row in rows)
    counted = any(row.nodes is not None for row in rows)
    header = ["case", "asked for"]
    if barred:
        header += ["[upstream]", "[prototype]", "bar"]
    for name in binaries:
        header += [f"{name} s", "spread", "MB", "result"]
    header += [f"{name}/{binaries[0]}" for name in binaries[1:]]
    if barred:
        header.append("met")
    if counted:
        header.append("nodes")
    lines = [_line(row, binaries, barred, counted) for row in rows]
    widths = [max(len(line[i]) for line in [header, *lines]) for i in range(len(header))]
    text = [
        "  ".join(
            cell.ljust(width) if i < 2 else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in [header, ["-" * width for width in widths], *lines]
    ]
    if barred:
        text.append("\n[ ]: quoted from one earlier measurement on such a machine, not run here.")
    return "\n".join(text)


def _line(row: Row, binaries: Sequence[str], barred: bool, counted: bool) -> list[str]:
    case = row.case
    cells = [case.name, case.mode]
    if barred:
        cells += [
            f"[{case.upstream}]" if case.upstream else "",
            f"[{case.prototype}]" if case.prototype is not None else "",
            f"{case.bar:g}" if case.bar is not None else "",
        ]
    for name in binaries:
        result = row.results[name]
        low, high = result.cpu_spread
        cells += [
            ("> " if result.ending == "timeout" else "") + _seconds(result.cpu_seconds),
            f"{_seconds(low)}-{_seconds(high)}" if result.runs > 1 else "",
            f"{result.peak_mb:.0f}",
            result.ending,
        ]
    first = row.results[binaries[0]].cpu_seconds
    for name in binaries[1:]:
        cells.append(f"{row.results[name].cpu_seconds / first:.2f}" if first > 0 else "")
    if barred:
        cells.append(_met(case, row.results[binaries[0]]))
    if counted:
        cells.append(str(row.nodes) if row.nodes is not None else "")
    return cells


def _seconds(value: float) -> str:
    return f"{value:.3f}" if value < 1 else f"{value:.2f}"


def _met(case: Case, result: Summary) -> str:
    if case.bar is None:
        return ""
    if result.ending in ("timeout", "failed"):
        return "no"
    within = result.cpu_seconds <= case.bar and result.peak_mb <= MEMORY_BAR
    return "yes" if within else "no"
