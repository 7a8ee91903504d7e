"""A real Dask cluster with worker processes, in its own process, since it leaves threads, event
loops and warnings behind.

Prints its address and the processes of its workers; ends when standard input does.
"""

import json
import logging
import sys

if __name__ == "__main__":
    from dask import config
    from distributed import LocalCluster

    # Workers are forked from one process that has imported everything.
    config.set({"distributed.worker.multiprocessing-method": "forkserver"})
    workers = int(sys.argv[1])
    cluster = LocalCluster(
        n_workers=workers,
        threads_per_worker=1,
        processes=True,
        dashboard_address=None,
        worker_dashboard_address=None,
        silence_logs=logging.CRITICAL,
    )
    with cluster:
        pids = [nanny.pid for nanny in cluster.workers.values()]
        print(json.dumps({"address": cluster.scheduler_address, "pids": pids}), flush=True)
        sys.stdin.read()
