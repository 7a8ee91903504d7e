"""Files saved from a run: a replay, one in 3D, a picture of each tick, a bundle."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

from safenav.errors import UsageError
from safenav.extras import missing

MOST_FRAMES = 1000


def replay_page(trace: bytes, name: str) -> bytes:
    """The replay as one HTML page."""
    from safenav.report.page.html import page_of_trace
    from safenav.trace.reading import read_bytes

    return page_of_trace(read_bytes(trace, name), name).encode()


def page_3d(trace: bytes, name: str) -> bytes:
    """The run so far in 3D as one HTML page. Raises UsageError without the extra ``motion``."""
    try:
        from safenav.motion.making import motion_of
    except ModuleNotFoundError as error:
        raise missing("the 3D page", str(error.name), "motion") from error
    from safenav.report.view3d.html import page3d_of
    from safenav.trace.reading import read_bytes

    read = read_bytes(trace, name)
    return page3d_of(read, name, motion_of(read)).encode()


def frames(trace: bytes, name: str) -> bytes:
    """A picture of every tick, zipped: PNG, or SVG without the extra ``pictures``. Raises
    UsageError for a run that is too long."""
    from safenav.report.picture.raster import png_of
    from safenav.report.picture.scene import Options, svg_of
    from safenav.report.replay.reading import replay_of
    from safenav.trace.reading import read_bytes

    replay = replay_of(read_bytes(trace, name))
    if replay.last >= MOST_FRAMES:
        raise UsageError(
            f"pictures of {replay.last + 1} ticks are too many: at most {MOST_FRAMES}\n"
            "    save the trace, and take a part: safenav replay run.jsonl --gif --ticks 0-500"
        )
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as files:
        for tick in range(replay.last + 1):
            svg = svg_of(replay.scene(tick), Options(legend=False))
            try:
                files.writestr(f"tick-{tick:04}.png", png_of(svg, 960))
            except UsageError:  # nothing draws pixels here
                files.writestr(f"tick-{tick:04}.svg", svg)
    return packed.getvalue()


def bundle(trace: bytes, name: str) -> bytes:
    """The run with its proofs and their checker, zipped. Raises SafenavError where the checker does
    not accept it."""
    from safenav.certify.record import bundle_of_trace

    with TemporaryDirectory() as folder:
        file, out = Path(folder) / name, Path(folder) / "bundle.zip"
        file.write_bytes(trace)
        bundle_of_trace(file, out)
        return out.read_bytes()


Saver = Callable[[bytes, str], bytes]

SAVERS: Mapping[str, tuple[Saver, str, str]] = {
    "trace": (lambda trace, _: trace, ".jsonl", "application/jsonl"),
    "replay": (replay_page, ".html", "text/html"),
    "3d": (page_3d, ".3d.html", "text/html"),
    "frames": (frames, "-frames.zip", "application/zip"),
    "bundle": (bundle, ".zip", "application/zip"),
}
"""For each name in an address: the function that makes the file, its name's end, its media type."""
