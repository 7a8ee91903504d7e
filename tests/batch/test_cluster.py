"""Batches on a real Dask cluster: no result is lost when a worker is killed."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest

from batch.conftest import SlugsLog, Write, safenav, started, wait_until
from children import ran

# Not imported: each worker of the tests would import it for the processes that do.
MISSING = find_spec("distributed") is None
pytestmark = [pytest.mark.slow, pytest.mark.skipif(MISSING, reason="needs the extra 'dask'")]
PROGRAM = """\
import json, logging, sys
from dask import config
from distributed import LocalCluster

# Workers are forked from one process that has imported everything.
config.set({"distributed.worker.multiprocessing-method": "forkserver"})
quiet = {"dashboard_address": None, "worker_dashboard_address": None}
with LocalCluster(
    n_workers=2, threads_per_worker=1, silence_logs=logging.CRITICAL, **quiet
) as cluster:
    pids = [nanny.pid for nanny in cluster.workers.values()]
    print(json.dumps([cluster.scheduler_address, pids]), flush=True)
    sys.stdin.read()
"""
"""A cluster with worker processes, in its own process, since it leaves threads, event loops and
warnings behind. Prints its address and its workers; ends when standard input does."""

Cluster = tuple[str, list[int], Callable[[], None]]


@pytest.fixture
def cluster(slugs: SlugsLog) -> Iterator[Cluster]:
    """Address, workers and end of a cluster, started after ``slugs`` is in place: workers inherit
    the environment."""
    del slugs
    pipe, command = subprocess.PIPE, [sys.executable, "-c", PROGRAM]
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True, cwd="/") as process:
        assert process.stdout is not None
        address, pids = json.loads(process.stdout.readline())
        yield address, pids, lambda: process.communicate("", timeout=300) and None


def test_a_killed_dask_worker_loses_nothing(
    write: Write, cluster: Cluster, slugs: SlugsLog
) -> None:
    address, workers, _ = cluster
    for number in range(10):
        write(f"suite/{number}.yaml", "slow")
    write("suite/wrong.yaml", "slow", expect="{outcome: completed}")
    with started("suite", "--dask", address, "--json", "--out", "out") as batch:
        # Some are done, and one runs on each worker.
        wait_until(batch, lambda: len(slugs.pids) >= 4)
        os.kill(workers[0], signal.SIGKILL)
        output, errors = batch.communicate(timeout=300)
    assert batch.returncode == 1, errors
    results = {result["name"]: result for result in json.loads(output)["results"]}
    assert len(results) == 11
    failed = [name for name, result in results.items() if result["verdict"] != "passed"]
    assert failed == ["suite/wrong.yaml"]
    assert len(slugs.pids) >= 11
    assert slugs.all_gone()
    (trace,) = Path("out/failures").iterdir()
    assert trace.suffix == ".jsonl"


@pytest.mark.parametrize("lost", [False, True])
def test_an_interruption_or_a_lost_cluster_ends_the_work_and_keeps_the_results(
    write: Write, cluster: Cluster, slugs: SlugsLog, lost: bool
) -> None:
    address, _, close = cluster
    write("a.yaml")
    write("b.yaml", "sleeper")
    words = ["a.yaml", "b.yaml", "--dask", address, "--out", "out"]
    state = Path("out/results.jsonl")
    with started(*words) as batch:
        wait_until(batch, lambda: len(slugs.pids) == 2 and "a.yaml" in state.read_text())
        close() if lost else batch.send_signal(signal.SIGINT)
        _, errors = batch.communicate(timeout=300)
    assert batch.returncode == (4 if lost else 130)
    assert (f"the Dask cluster at {address} is gone" in errors) == lost
    assert "--resume" in errors
    assert slugs.all_gone()
    assert len(state.read_text().splitlines()) == 1
    if not lost:
        write("b.yaml", "quick")
        done = safenav(*words, "--resume")
        assert done.returncode == 0
        assert "2 passed" in done.stdout and "(1 of them from earlier runs)" in done.stdout


def test_an_address_without_a_dask_cluster_is_bad_input(write: Write) -> None:
    write("a.yaml")
    safenav("a.yaml", "--out", "out")
    program = (
        "import safenav.batch.pool as pool; pool._CONNECT_SECONDS = 1; "
        "from safenav.cli import main; main()"
    )
    words = ("batch", "a.yaml", "--dask", "tcp://127.0.0.1:9", "--out", "out")
    done = ran([sys.executable, "-c", program, *words])
    assert done.returncode == 2
    assert len(Path("out/results.jsonl").read_text().splitlines()) == 1  # still there
    assert "no Dask cluster answers at tcp://127.0.0.1:9" in done.stderr
    assert "Traceback" not in done.stderr
