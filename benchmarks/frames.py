"""Frames that a page paints in a real browser, and what they say about it."""

import statistics
from itertools import pairwise
from typing import Any

_STAMPS = """
    const [milliseconds, done] = arguments, stamps = [];
    const first = performance.now();
    const note = now => {
        stamps.push(now);
        if (now - first < milliseconds) requestAnimationFrame(note); else done(stamps);
    };
    requestAnimationFrame(note);
"""


def gaps_of(driver: Any, seconds: float) -> list[float]:
    """Milliseconds between the frames that the page paints in this many seconds, sorted."""
    driver.set_script_timeout(seconds * 4 + 30)
    stamps = driver.execute_async_script(_STAMPS, seconds * 1000)
    return sorted(b - a for a, b in pairwise(stamps))


def described(gaps: list[float]) -> str:
    """Frames per second, and how even they are."""
    rate = 1000 * len(gaps) / sum(gaps)
    median, most = statistics.median(gaps), gaps[int(0.95 * len(gaps))]
    return f"{rate:.1f} frames/s, median gap {median:.1f} ms, 95 % {most:.1f} ms"
