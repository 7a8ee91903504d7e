"""The studio as other programs and pages of this machine see it: which requests it answers, and
which files it reads and writes."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.error import HTTPError

import pytest

from once import SCENARIOS
from studio.serving import Served

HELLO = SCENARIOS / "hello.yaml"
LARGEST = 8_000_000
"""Bytes of a request."""


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    with Served("run", HELLO, "--live") as found:
        yield found


OURS, ELSEWHERE = "Host: 127.0.0.1:PORT", ("http://evil.example", "null", "http://localhost:PORT")


@pytest.mark.parametrize(
    ("target", "lines", "status"),
    [
        *((f"/TOKEN/{name}", [OURS], 200) for name in ("", "page.js", "studio.js", "page.css")),
        ("/TOKEN/schema.json", [OURS], 200),
        ("/TOKEN/save/scenario", [OURS], 200),
        ("/TOKEN/", ["Host: localhost:PORT"], 200),
        ("/TOKEN/", [OURS, "Origin: http://127.0.0.1:PORT"], 200),
        ("/TOKEN/", [OURS, "Sec-Fetch-Site: same-origin"], 200),
        ("/", [OURS], 404),
        ("/guess/studio.js", [OURS], 404),
        ("/TOKENs/", [OURS], 404),
        ("//TOKEN/", [OURS], 404),
        ("/TOKEN/../../etc/passwd", [OURS], 404),
        ("/TOKEN/..%2f..%2fpyproject.toml", [OURS], 404),
        ("/TOKEN/save/%2e%2e/page.py", [OURS], 404),
        ("/TOKEN/", ["Host: 127.0.0.1:80"], 421),
        ("/TOKEN/", ["Host: rebound.example"], 421),
        ("/TOKEN/", [], 421),
        *(("/TOKEN/events", [OURS, f"Origin: {name}"], 403) for name in ELSEWHERE),
        ("/TOKEN/", [OURS, "Sec-Fetch-Site: cross-site"], 403),
        ("/TOKEN/say", [OURS, f"Content-Length: {LARGEST + 1}"], 413),
        ("/TOKEN/say", [OURS, "Content-Length: \xb2"], 413),
        ("/TOKEN/say", [OURS, "Transfer-Encoding: chunked"], 413),
        ("/TOKEN/say", [OURS, f"Content-Length: {'9' * 5000}"], 413),
        ("two words", [], 400),
        ("\xff", [OURS], 400),
    ],
    ids=lambda part: str(part)[:40],
)
def test_each_request_has_its_status_and_each_answer_a_strict_policy(
    target: str, lines: list[str], status: int, editor: Served
) -> None:
    """With a policy that forbids the page everything else, and before its body is read."""
    head = "\r\n".join((f"GET {target} HTTP/1.1", *lines, "", ""))
    head = head.replace("PORT", str(editor.port)).replace("TOKEN", editor.token)
    with editor.request(head) as connection, connection.makefile("rb") as answer:
        assert int(answer.readline().split()[1]) == status
        said = answer.read().partition(b"\r\n\r\n")[0].decode()
    assert "Cross-Origin-Resource-Policy: same-origin" in said
    assert "frame-ancestors 'none'" in said and "Access-Control-Allow-Origin" not in said
    assert ('; filename="__.yaml"' in said) is ("save/s" in target)


def test_a_studio_listens_on_the_loopback_interface_only(served: Served) -> None:
    listening = Path("/proc/net/tcp")
    if not listening.exists():
        pytest.skip("asks Linux who listens where")
    port = f":{served.port:04X}"
    local = [line.split()[1] for line in listening.read_text().splitlines()[1:]]
    assert {entry.split(":")[0] for entry in local if entry.endswith(port)} == {"0100007F"}


def test_an_invalid_message_is_refused_and_the_next_one_served(served: Served) -> None:
    with served.opened() as page:
        for nonsense in ('{"do": "fly"}', '{"do": "speed", "value": "fast"}', '{"do": "change"}'):
            page.post(nonsense.encode())
            assert page.refusal()
        page.post(b"[" * 100_000)
        assert page.refusal()
        page.say("speed", value=64)


def test_a_failed_download_reports_the_reason(tmp_path: Path) -> None:
    file = tmp_path / "assigned.yaml"
    file.write_text(f"{HELLO.read_text()}coordination: assignable\n")
    with Served("run", file, "--live") as served, served.opened() as page:
        page.begin()
        for name, status, why in (
            ("bundle", 400, b"assignable"),
            ("nothing", 404, b"nothing to save"),
        ):
            with pytest.raises(HTTPError) as refused:
                page.get(f"save/{name}")
            assert refused.value.code == status and why in refused.value.read()


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("home")
    (found / "lab").mkdir()
    (found / "secret.yaml").write_text("somebody else's\n")
    (found / "lab" / "link.yaml").symlink_to(found / "secret.yaml")
    return found


@pytest.fixture(scope="module")
def editor(home: Path) -> Iterator[Served]:
    with Served("studio", home / '"\u00e9.yaml', "--folder", home / "lab", "--no-browser") as found:
        yield found


@pytest.mark.parametrize("file", ["new.yaml", ""])
def test_a_file_that_does_not_exist_yet_is_unsaved_and_a_blank_text_is_not(
    file: str, tmp_path: Path
) -> None:
    words = [file] if file else []
    with Served("studio", *words, "--no-browser", cwd=tmp_path) as found, found.opened() as page:
        for _ in range(2):
            assert page.document("safenav")["dirty"] == bool(file)
            page.say("open", kind="blank")


@pytest.mark.parametrize(
    ("name", "why"),
    [
        *((f"{outside}out.yaml", "a name in") for outside in ("/tmp/", "../", ".")),
        ("sub/out.yaml", "no folder"),
        ("out.py", "a name in"),
        ("link.yaml", "is a link, or leads outside"),
        (f"{'n' * 5000}.yaml", "too long"),
    ],
    ids=lambda words: words[:12],
)
def test_nothing_is_written_outside_the_folder(
    name: str, why: str, editor: Served, home: Path
) -> None:
    with editor.opened() as page:
        page.say("save", name=name)
        assert why in page.refusal()
        page.say("open", kind="file", name=name)
        assert why in page.refusal()
    assert not [*home.glob("*out*")]
    assert (home / "secret.yaml").read_text() == "somebody else's\n"


def test_a_file_in_the_folder_is_written_whole(editor: Served, home: Path) -> None:
    with editor.opened() as page:
        page.say("open", kind="template", name="door")
        told = page.document("a door on the way")
        page.say("save", name="door.yaml")
        page.hear(lambda m: m["is"] == "saved")
        assert (home / "lab" / "door.yaml").read_text() == told["text"]
        (home / "lab" / "crlf.yaml").write_bytes(b'safenav: 1\r\nmap: {grid: ["."]}\r\n')
        page.say("open", kind="file", name="crlf.yaml")
        assert page.document("grid: [")["drawing"]["run"]["name"] == "crlf"
        page.say("text", text="safenav: 1\r\n# mine\r\n")
        page.say("save")
        page.hear(lambda m: m["is"] == "saved")  # the file has not changed since it was opened


@pytest.mark.parametrize(
    ("does", "data", "why"),
    [
        ("open", {"kind": "blank", "rows": 2, "cols": 6}, "has 3 to 512 rows"),
        ("open", {"kind": "blank", "rows": 7.5, "cols": 6}, "has 3 to 512 rows"),
        ("open", {"kind": "template", "name": "castle"}, "no template 'castle'"),
        ("text", {"text": "x" * 5_000_001}, "at most 5 MB"),
    ],
)
def test_an_impossible_request_is_refused_with_the_reason(
    does: str, data: dict[str, Any], why: str, editor: Served
) -> None:
    with editor.opened() as page:
        assert why in (page.say(does, **data) or "")


@pytest.mark.slow
def test_a_page_that_stops_reading_is_disconnected(editor: Served) -> None:
    head = f"GET /{editor.token}/events HTTP/1.1\r\nHost: 127.0.0.1:{editor.port}\r\n\r\n"
    with editor.request(head) as stopped, editor.opened() as page:
        for number in range(10):
            page.say("text", text=f"# {number}" + '"' * 3_900_000)
            page.document(f"# {number}")  # this page reads all
        while stopped.recv(1_000_000):
            pass
        page.say("text", text="safenav: 1\n# read\n")
        page.document("# read")


def test_two_editors_of_one_text_agree(editor: Served) -> None:
    with editor.opened() as one, editor.opened() as other:
        one.say("open", kind="blank", rows=5, cols=6)
        other.document("    ######\n")
        other.say("edit", op="paint", regions=[8], wall=True)
        told, again = (page.document("    #.#..#") for page in (one, other))
    assert (told["text"], told["revision"]) == (again["text"], again["revision"])


def test_a_failing_synthesizer_is_reported_on_the_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SAFENAV_SLUGS", "/bin/false")
    with Served("studio", tmp_path / "lab.yaml", "--no-browser") as served, served.opened() as page:
        page.say("text", text=HELLO.read_text())
        found = page.hear(lambda m: m.get("verdicts"))["verdicts"]["rover"]
    assert found["verdict"] == "unknown" and "/bin/false" in found["because"]


@pytest.mark.parametrize("named", ["flat", "flat/flat.yaml"])
def test_a_map_is_read_from_the_folder_and_from_nowhere_else(named: str, tmp_path: Path) -> None:
    flat = "P2 4 4 255\n0 0 0 0\n0 255 255 0\n0 255 255 0\n0 0 0 0\n"
    text = "safenav: 1\nmap: {image: IMAGE, rows: 4, cols: 4}\n"
    text += "robots: {eye: {model: quadcopter, start: [1, 1], objective: {hold: [1, 1]}}}\n"
    (tmp_path / "flat").mkdir()
    for file, content in (
        ("floor.pgm", flat),
        ("flat.yaml", text.replace("IMAGE", "floor.pgm")),
        ("out.yaml", text.replace("IMAGE", "../floor.pgm")),
    ):
        (tmp_path / "flat" / file).write_text(content)
    with Served("studio", tmp_path / named, "--no-browser") as served, served.opened() as page:
        page.say("open", kind="file", name="flat.yaml")
        told = page.document("floor.pgm")
        while told["file"] != "flat.yaml":  # the first one is that of the command
            told = page.document("floor.pgm")
        assert told["drawing"]["run"]["rows"] == 4 and not told["problems"]
        page.say("edit", op="paint", regions=[5], wall=True)
        assert "the map comes from a file" in page.refusal()
        page.say("open", kind="file", name="out.yaml")
        told = page.document("../floor.pgm")
        assert told["drawing"] is None, "the map before is not that of this one"
        (problem,) = told["problems"]
        assert "outside the folder" in problem["found"] and "--folder" in problem["hint"]
