"""The cache: correct results or none, whatever happens to its directory."""

import os
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path

import pytest

from safenav import Specification, Synthesizer, Verdict
from safenav.synthesis.cache import Cache, CacheEntry, CacheWarning
from safenav.synthesis.program import Binary

KEY = "ab" + "0" * 62
ENTRY = CacheEntry(Verdict.REALIZABLE, 0.125, b'{"nodes": "\n\xff"}')


@pytest.fixture
def cache(tmp_path: Path) -> Cache:
    return Cache(tmp_path / "answers")


def _files(cache: Cache) -> list[Path]:
    assert cache.directory is not None
    return sorted(p for p in cache.directory.rglob("*") if p.is_file())


def test_every_flipped_byte_and_every_truncation_is_detected(cache: Cache) -> None:
    cache.store(KEY, CacheEntry(Verdict.TIMEOUT, 60.0, None))
    assert cache.load(KEY) is None, "exhausted limits are not stored"
    cache.store(KEY, ENTRY)
    (file,) = _files(cache)
    good = file.read_bytes()
    damaged = [good[:cut] for cut in range(len(good))]
    damaged += [good[:i] + bytes([good[i] ^ 1]) + good[i + 1 :] for i in range(len(good))]
    for data in (*damaged, good + b"x", b"\0" * len(good)):
        file.write_bytes(data)
        assert cache.load(KEY) is None
        assert not file.exists(), "a damaged entry is dropped"
    cache.store(KEY, ENTRY)
    other = "ab1" + KEY[3:]
    file.rename(file.with_name(other + file.suffix))
    assert cache.load(other) is None, "an entry under another name is not believed"


def test_the_oldest_results_are_removed_from_a_full_cache(tmp_path: Path) -> None:
    size = 10_000
    keys = [f"{i:02x}" * 32 for i in range(12)]
    cache = Cache(tmp_path / "answers", limit_bytes=8 * size)
    half = tmp_path / "answers" / "00" / f".{keys[0]}.1.of-a-killed-writer"
    other = tmp_path / "answers" / "go" / "of-somebody-else.txt"
    for file in (half, other):
        file.parent.mkdir(parents=True)
        file.write_bytes(b"half")
        os.utime(file, (1e8, 1e8))
    for age, key in enumerate(keys):
        cache.store(key, CacheEntry(Verdict.REALIZABLE, 1.0, bytes(size)))
        for file in _files(cache):
            if file.stem == key:
                os.utime(file, (1e9 + age, 1e9 + age))
    assert sum(f.stat().st_size for f in _files(cache)) <= 8 * size
    kept = [key for key in keys if cache.load(key) is not None]
    assert kept and kept == keys[-len(kept) :]
    assert not half.exists()
    assert other.exists()


def test_a_directory_that_cannot_be_written_costs_one_warning(tmp_path: Path) -> None:
    place = tmp_path / "answers"
    place.write_text("a file in the way")
    cache = Cache(place)
    with pytest.warns(CacheWarning, match="SAFENAV_CACHE") as heard:
        cache.store(KEY, ENTRY)
        cache.store(KEY, ENTRY)
    assert len(heard) == 1
    assert cache.load(KEY) is None


def test_a_full_disk_leaves_no_half_entry(cache: Cache, monkeypatch: pytest.MonkeyPatch) -> None:
    real = Path.write_bytes

    def full(path: Path, data: bytes) -> int:
        real(path, data[:10])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.warns(CacheWarning, match="No space left"):
        cache.store(KEY, ENTRY)
    assert _files(cache) == []


@pytest.mark.parametrize(
    ("named", "xdg", "folder"),
    [
        ("/here", None, Path("/here")),
        ("OFF", None, None),
        (None, "/xdg", Path("/xdg/safenav")),
        (None, "not/absolute", Path("/home/me/.cache/safenav")),
    ],
)
def test_the_environment_determines_the_folder_of_the_cache(
    named: str | None, xdg: str | None, folder: Path | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in (("SAFENAV_CACHE", named), ("XDG_CACHE_HOME", xdg), ("HOME", "/home/me")):
        monkeypatch.delenv(name, raising=False)
        if value is not None:
            monkeypatch.setenv(name, value)
    assert Cache.from_environment().directory == folder


def test_a_request_is_synthesized_once(
    answering: Callable[[bytes], Binary],
    patrol: Specification,
    patrol_json: bytes,
    tmp_path: Path,
) -> None:
    """Another request, or another binary in its place, is synthesized again."""
    binary = answering(patrol_json)
    first, second = (Synthesizer(binary).synthesize(patrol) for _ in range(2))
    assert (first.cached, second.cached) == (False, True)
    assert second.strategy_json == first.strategy_json
    assert second.strategy_sha256 == first.strategy_sha256
    assert second.seconds == first.seconds
    assert second.strategy is not None and second.strategy.initial() == (0,)
    assert (second.robot, second.states, second.verified) == ("carrier", 9, None)
    assert len(first.strategy_sha256 or "") == 64 and 0 < first.seconds < 300
    assert not Synthesizer(binary).synthesize(patrol, strategy=False).cached
    binary.path.write_text(binary.path.read_text() + "# a newer version\n")
    assert not Synthesizer(Binary(binary.path)).synthesize(patrol).cached
    assert (tmp_path / "calls").read_text() == "call\n" * 3


def test_a_text_is_kept_under_its_sha256_and_a_damaged_one_is_gone(tmp_path: Path) -> None:
    cache, text = Cache(tmp_path), "[OUTPUT]\nx\n"
    name = sha256(text.encode()).hexdigest()
    assert cache.load_text(name) is None
    cache.keep_text(name, text)
    assert cache.load_text(name) == text
    (file,) = (p for p in tmp_path.rglob("*") if p.is_file())
    file.write_text("[OUTPUT]\ny\n")
    assert cache.load_text(name) is None
    file.write_text(text)  # as an older version kept it
    cache.keep_text(name, text)
    assert cache.load_text(name) == text
