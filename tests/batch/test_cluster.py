"""Batches on a real Dask cluster: no result is lost when a worker is killed."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest

import warm
from batch.made_scenarios import SlugsLog, Write
from batch.running import environment, safenav, started, wait_until

# Not imported: each worker of the tests would import it for the processes that do.
MISSING = find_spec("distributed") is None
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(MISSING, reason="needs the extra 'dask'"),
]


class Cluster:
    def __init__(self, workers: int) -> None:
        script = str(Path(__file__).with_name("dask_cluster.py"))
        self._process = subprocess.Popen(
            [sys.executable, script, str(workers)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=environment(),
            cwd="/",  # somewhere else than the batch
        )
        assert self._process.stdout is not None
        told = json.loads(self._process.stdout.readline())
        self.address: str = told["address"]
        self.pids: list[int] = told["pids"]

    def close(self) -> None:
        if self._process.returncode is None:
            self._process.communicate("", timeout=300)


@pytest.fixture
def cluster(slugs: SlugsLog) -> Iterator[Cluster]:
    """Started after ``slugs`` is in place: workers inherit the environment."""
    del slugs
    cluster = Cluster(2)
    yield cluster
    cluster.close()


def test_a_killed_dask_worker_loses_nothing(
    write: Write, cluster: Cluster, slugs: SlugsLog
) -> None:
    for number in range(10):
        write(f"suite/{number}.yaml", "slow")
    write("suite/wrong.yaml", "slow", expect="{outcome: completed}")
    words = ["suite", "--dask", cluster.address, "--json", "--out", "out"]
    with started(*words) as batch:
        # Some are done, and one runs on each worker.
        wait_until(batch, lambda: len(slugs.pids) >= 4)
        os.kill(cluster.pids[0], signal.SIGKILL)
        output, errors = batch.communicate(timeout=300)
    assert batch.returncode == 1, errors
    results = {result["name"]: result for result in json.loads(output)["results"]}
    assert len(results) == 11
    failed = [name for name, result in results.items() if result["verdict"] != "passed"]
    assert failed == ["suite/wrong.yaml"]
    assert len(slugs.pids) >= 11
    assert slugs.all_gone()
    (folder,) = Path("out/failures").iterdir()
    assert {path.name for path in folder.iterdir()} == {"reason.txt", "trace.jsonl", "replay.html"}


def test_an_interrupted_batch_stops_its_work_on_the_cluster(
    write: Write, cluster: Cluster, slugs: SlugsLog
) -> None:
    write("a.yaml")
    write("b.yaml", "sleeper")
    words = ["a.yaml", "b.yaml", "--dask", cluster.address, "--out", "out"]
    state = Path("out/results.jsonl")
    with started(*words) as batch:
        wait_until(batch, lambda: len(slugs.pids) == 2 and "a.yaml" in state.read_text())
        batch.send_signal(signal.SIGINT)
        batch.communicate(timeout=300)
    assert batch.returncode == 130
    assert slugs.all_gone()
    write("b.yaml", "quick")
    done = safenav(*words, "--resume")
    assert done.returncode == 0
    assert "2 passed" in done.stdout and "(1 of them done before)" in done.stdout


def test_an_address_where_nothing_answers_is_bad_input(write: Write, slugs: SlugsLog) -> None:
    del slugs
    write("a.yaml")
    safenav("a.yaml", "--out", "out")
    words = ("batch", "a.yaml", "--dask", "tcp://127.0.0.1:9", "--out", "out")
    done = warm.program("batch.impatient", *words, env=environment())
    assert done.returncode == 2
    assert len(Path("out/results.jsonl").read_text().splitlines()) == 1  # still there
    assert "no Dask cluster answers at tcp://127.0.0.1:9" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_lost_cluster_ends_the_batch_with_its_results_kept(
    write: Write, cluster: Cluster, slugs: SlugsLog
) -> None:
    write("a.yaml")
    write("b.yaml", "sleeper")
    state = Path("out/results.jsonl")
    with started("a.yaml", "b.yaml", "--dask", cluster.address, "--out", "out") as batch:
        wait_until(batch, lambda: len(slugs.pids) == 2 and "a.yaml" in state.read_text())
        cluster.close()
        _, errors = batch.communicate(timeout=300)
    assert batch.returncode == 4
    assert f"the Dask cluster at {cluster.address} is gone" in errors
    assert "--resume" in errors
    assert slugs.all_gone()
    assert len(state.read_text().splitlines()) == 1
