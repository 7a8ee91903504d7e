"""What no command shows: files of the cache are correct or ignored, whatever happens to them; the
places of the binary."""

import os
from hashlib import sha256
from pathlib import Path

import pytest

from safenav import Synthesizer, SynthesizerError, Verdict, read_specification
from safenav.synthesis.cache import Cache, CacheEntry, CacheWarning

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


def test_a_full_disk_leaves_no_half_entry(cache: Cache, monkeypatch: pytest.MonkeyPatch) -> None:
    real = Path.write_bytes

    def full(path: Path, data: bytes) -> int:
        real(path, data[:10])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.warns(CacheWarning, match="No space left"):
        cache.store(KEY, ENTRY)
    assert _files(cache) == []


def test_a_text_is_kept_under_its_sha256_and_a_damaged_one_is_gone(tmp_path: Path) -> None:
    """And in memory, where there is no directory: a bundle of a run needs it."""
    text = "[OUTPUT]\nx\n"
    name = sha256(text.encode()).hexdigest()
    assert Cache(tmp_path).load_text(name) is None
    for cache in (Cache(tmp_path), nowhere := Cache(None)):
        cache.keep_text(name, text)
    assert Cache(tmp_path).load_text(name) == nowhere.load_text(name) == text
    (file,) = (p for p in tmp_path.rglob("*") if p.is_file())
    file.write_text("[OUTPUT]\ny\n")
    assert Cache(tmp_path).load_text(name) is None
    file.write_text(text)  # as an older version kept it
    Cache(tmp_path).keep_text(name, text)
    assert Cache(tmp_path).load_text(name) == text


# From the first choice to the last: in the package, in an installation of it, in the source tree.
PLACES = ("tree/safenav/_bin/slugs", "site-packages/safenav/_bin/slugs", "tree/slugs/build/slugs")


def _program(path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("#!/bin/sh\n")
    path.chmod(0o755)
    return path


def test_the_environment_variable_the_package_and_the_source_tree_are_searched_in_turn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without any, the message says what to do."""
    monkeypatch.setattr("safenav.synthesis.program._PACKAGE", tmp_path / "tree" / "safenav")
    monkeypatch.setattr("sysconfig.get_path", lambda _: str(tmp_path / "site-packages"))
    monkeypatch.delenv("SAFENAV_SLUGS", raising=False)
    with pytest.raises(SynthesizerError, match="make slugs") as raised:
        Synthesizer()
    assert "SAFENAV_SLUGS" in str(raised.value)
    for place in reversed(PLACES):
        program = _program(tmp_path / place)
        assert Synthesizer().binary == program
    named = _program(tmp_path / "with space ü" / "slugs")
    with pytest.raises(SynthesizerError, match=r"cannot be read: No such file"):
        Synthesizer(named.with_name("lost")).synthesize(read_specification("[OUTPUT]\nx\n"))
    monkeypatch.setenv("SAFENAV_SLUGS", str(named))
    assert Synthesizer().binary == named
