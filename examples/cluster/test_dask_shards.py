"""Two workers of dask_shards.py, one of them killed in the middle of a shard: the bytes of an undisturbed run?

    python test_dask_shards.py HOST_SIM FOLDER
"""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

from dask.distributed import Client, LocalCluster

from dask_shards import run

SHARDS = 4
PLAN = ["--uncertain", "50", "--set", "span_s=0.2", "--set", "window_s=[0.1, 0.2]", "--trials", "800", "--chunk", "20"]


def kill_one(client, out, killed):
    """Kills the worker that began the first shard, as soon as a chunk of it is there; its program goes with it."""
    while not list(Path(out).glob("shard-*.chunks/*.parquet")):
        time.sleep(0.002)
    for worker in client.run(os.getpid).values():
        children = subprocess.run(["pgrep", "-P", str(worker)], capture_output=True, text=True).stdout.split()
        if children:
            for child in [worker, *map(int, children)]:
                os.kill(child, signal.SIGKILL)
            killed.append(worker)
            return


def main(program, folder):
    command = [program, "monte-carlo", *PLAN, "--threads", "1"]
    disturbed, alone = f"{folder}/disturbed", f"{folder}/alone"
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        killed = []
        killer = threading.Thread(target=kill_one, args=(client, disturbed, killed))
        killer.start()
        status = run(client, command, SHARDS, disturbed)
        killer.join(60)
    assert status == 0, f"merge: exit status {status}"
    assert killed, "no worker was killed"
    subprocess.run([*command, "--out", alone], check=True, stdout=subprocess.DEVNULL)
    ours, theirs = [Path(folder, name, "trials.parquet").read_bytes() for name in ("disturbed", "alone")]
    assert ours == theirs, "a worker's death changed the trials"
    print(f"worker {killed[0]} killed; {len(ours)} bytes, those of an undisturbed run")


if __name__ == "__main__":
    main(*sys.argv[1:])
