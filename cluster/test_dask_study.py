#!/usr/bin/env python3
"""Hold a study made on a local Dask cluster, one of whose workers is killed in
mid-study, against the same study made at once: every byte of the results.

    cluster/test_dask_study.py path/to/hil-runner
"""

import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

from dask.distributed import Client, LocalCluster

import dask_study

STUDY = """
name = "cluster"
base = "paper-2"
rungs = ["sampled", "quantised"]
plan = "random"
runs = 12000
feeding = false

[[axis]]
key = "transmission.backlash_half_deg"
distribution = { kind = "uniform", low = 0.0, high = 4.0 }

[[axis]]
key = "controller.kp"
distribution = { kind = "uniform", low = 1.0, high = 6.0 }
"""

SHARDS = 8
WORKERS = 3


def main():
    runner = str(Path(sys.argv[1]).resolve())
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        study = folder / "cluster.toml"
        study.write_text(STUDY)
        # Into the same folder, which the page shows, and then out of the way.
        out = folder / "results"
        subprocess.run([runner, "study", study, "--out", out], check=True, stdout=subprocess.DEVNULL)
        at_once = out.rename(folder / "at-once")
        killed = []
        with LocalCluster(
            n_workers=WORKERS, threads_per_worker=1, dashboard_address=None, local_directory=folder
        ) as cluster, Client(cluster) as client:
            victim = threading.Thread(target=kill_one, args=(client, Path(f"{out}-shards"), killed))
            victim.start()
            status = dask_study.make_study(client, runner, str(study), [], out, SHARDS)
            victim.join()
        assert status == 0, status
        assert killed and all(killed), "no worker was killed while its shard was being made"
        # Parquet, too.
        for path in sorted(at_once.rglob("*")):
            other = out / path.relative_to(at_once)
            if path.is_file() and path.name != "study.json":
                assert path.read_bytes() == other.read_bytes(), f"{path.name} differs"
        rows = sum(1 for _ in open(out / "results.csv")) - 1
        # A contrast: a shard alone is not the study.
        shard = Path(f"{out}-shards") / f"1-of-{SHARDS}" / "results.csv"
        assert shard.read_bytes() != (out / "results.csv").read_bytes()
    print(
        f"{SHARDS} shards on {WORKERS} workers, worker {killed[0]} killed in mid-shard: "
        f"{rows} rows, every byte as made at once"
    )


def kill_one(client, parts, killed):
    """Kill a worker that has begun a shard and not ended it."""
    for _ in range(2000):
        for address, tasks in client.processing().items():
            for key in tasks:
                number = str(key).split("-")[1]
                csv = parts / f"{number}-of-{SHARDS}" / "results.csv"
                if csv.exists() and csv.stat().st_size > 4096:
                    pid = client.run(os.getpid, workers=[address])[address]
                    still = key in client.processing().get(address, ())
                    os.kill(pid, signal.SIGKILL)
                    killed.append(still and pid)
                    return
        time.sleep(0.005)


if __name__ == "__main__":
    main()
