"""A Monte Carlo run of host-sim in shards on a Dask cluster: two workers here, or any scheduler there is.

    pip install distributed==2026.8.0
    python dask_shards.py --shards 16 --out /shared/joint -- host-sim monte-carlo joint.toml --uncertain 50
    python dask_shards.py --scheduler tcp://head:8786 ..     (SSH, dask-jobqueue on Slurm, Kubernetes: the same file)

A shard is the command with `--shard I/N`: one file, the same bytes whoever computes it, as often as it is done. So
Dask may do it again wherever it likes: what a dead worker had begun goes on with `--resume`. In the end `host-sim merge`
holds all shards together and reports them. Program, scenario and folder must be reachable from every worker.
"""

import argparse
import subprocess
import sys
import time

from dask.distributed import Client, LocalCluster, as_completed


def shard(i, n, command, out):
    """One shard; its number."""
    while True:
        call = [*command, "--shard", f"{i}/{n}", "--out", out, "--resume"]
        done = subprocess.run(call, capture_output=True, text=True)
        if done.returncode == 0:
            return i
        # What a dead worker left behind may still compute it: it is waited for, and its file taken.
        if "another run is writing there" not in done.stderr:
            raise RuntimeError(f"shard {i}/{n}: {done.stderr.strip()}")
        time.sleep(1)


def run(client, command, shards, out):
    """All shards, each tried up to four times, and the report of host-sim."""
    work = client.map(shard, range(1, shards + 1), n=shards, command=command, out=out, retries=3, pure=False)
    for count, future in enumerate(as_completed(work), 1):
        print(f"{count} of {shards} shards, the last one {future.result()}", flush=True)
    files = [f"{out}/shard-{i}-of-{shards}.parquet" for i in range(1, shards + 1)]
    return subprocess.run([command[0], "merge", *files, "--out", out]).returncode


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scheduler", help="address of a scheduler; without one, workers on this machine")
    parser.add_argument("--workers", type=int, default=2, help="workers on this machine")
    parser.add_argument("--shards", type=int, default=8, help="some for each worker, of ten seconds or more each")
    parser.add_argument("--out", required=True, help="folder that every worker can write")
    parser.add_argument("command", nargs="+", help="host-sim monte-carlo FILE ..")
    asked = parser.parse_args()
    cluster = asked.scheduler or LocalCluster(n_workers=asked.workers, threads_per_worker=1, dashboard_address=None)
    with Client(cluster) as client:
        return run(client, asked.command, asked.shards, asked.out)


if __name__ == "__main__":
    sys.exit(main())
