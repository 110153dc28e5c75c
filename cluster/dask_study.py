#!/usr/bin/env python3
"""Make a study on a Dask cluster: one task a shard, lost ones again, then merge.

    pip install -r cluster/requirements.txt
    cluster/dask_study.py my-study.toml --out results --shards 64 --scheduler tcp://head:8786
    cluster/dask_study.py tolerance --out results --shards 16 --workers 4     # this machine only

Every worker needs the program and the folder of `--out` at the same place, as
a shared disk gives them. A shard whose worker dies is given to another one and
goes on where the dead one was; the merged results are those of one machine,
byte for byte. A task costs Dask some 10 ms, a run some 0.1 ms to 1 ms: give
shards thousands of runs.
"""

import argparse
import ctypes
import signal
import subprocess
import sys
import time
from pathlib import Path

# Attempts of a shard before the study is given up.
RETRIES = 5

# How long a shard is waited for that a dead worker's program still holds [s].
HELD_S = 60.0

IN_USE = "another process is at work on these results"


def dies_with_its_worker():
    """Ask Linux to end the program when its worker ends, however that does."""
    PR_SET_PDEATHSIG = 1
    try:
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    except (AttributeError, OSError):
        pass  # Elsewhere the lock of the shard's folder is waited for.


def make_shard(runner, study, options, shard, shards, folder, threads):
    """Make one shard; what is there of it already is kept. Returns its folder."""
    command = [runner, "study", study, *options]
    command += ["--shard", f"{shard}/{shards}", "--out", folder, "--threads", str(threads)]
    until = time.monotonic() + HELD_S
    while True:
        done = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            preexec_fn=dies_with_its_worker,
        )
        if done.returncode == 0:
            return folder
        if IN_USE not in done.stderr or time.monotonic() > until:
            raise RuntimeError(f"shard {shard}/{shards}: status {done.returncode}: {done.stderr.strip()}")
        time.sleep(0.2)


def from_anywhere(name_or_path, prints):
    """A path that workers can read, who may stand elsewhere; a name of the program's own,
    which the command `prints` knows, as it is: it means that even beside such a file."""
    known = subprocess.run(
        [*prints, name_or_path], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    return name_or_path if known.returncode == 0 else str(Path(name_or_path).resolve())


def study_and_options(arguments):
    """The study and the options of it that every shard gets."""
    runner = arguments.runner
    study = from_anywhere(arguments.study, [runner, "study", "--print"])
    options = []
    if arguments.base:
        options += ["--base", from_anywhere(arguments.base, [runner, "init"])]
    options += [word for override in arguments.sets for word in ("--set", override)]
    return study, options


def make_study(client, runner, study, options, out, shards, threads=1):
    """Make all shards of a study on a cluster and merge them into `out`."""
    from dask.distributed import as_completed

    parts = Path(f"{out}-shards")
    parts.mkdir(parents=True, exist_ok=True)
    folders = [str(parts / f"{number}-of-{shards}") for number in range(1, shards + 1)]
    tasks = [
        client.submit(
            make_shard, runner, study, options, number, shards, folder, threads,
            key=f"shard-{number}-of-{shards}", retries=RETRIES, pure=False,
        )
        for number, folder in enumerate(folders, start=1)
    ]
    for count, task in enumerate(as_completed(tasks), start=1):
        task.result()
        print(f"\r{count} of {shards} shards", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    return subprocess.run([runner, "study", "merge", str(out), *folders]).returncode


def parser():
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("study", help="study file or ready study")
    parser.add_argument("--out", required=True, type=Path, help="folder of the results, new or of this study")
    parser.add_argument("--shards", type=int, default=16, help="parts that the study is cut into [16]")
    parser.add_argument("--runner", default="hil-runner", help="the program [hil-runner on the path]")
    parser.add_argument("--threads", type=int, default=1, help="threads of a shard [1]")
    parser.add_argument("--base", help="case to study instead of the study's own")
    parser.add_argument("--set", dest="sets", action="append", default=[], metavar="KEY.PATH=VALUE")
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--scheduler", help="address of a Dask scheduler, such as tcp://head:8786")
    where.add_argument("--workers", type=int, help="workers on this machine [one a core]")
    return parser


def main():
    arguments = parser().parse_args()
    if arguments.shards < 1:
        parser().error("--shards must be at least 1")
    from dask.distributed import Client, LocalCluster

    study, options = study_and_options(arguments)
    out = arguments.out.resolve()
    if arguments.scheduler:
        client = Client(arguments.scheduler)
    else:
        cluster = LocalCluster(
            n_workers=arguments.workers, threads_per_worker=1, dashboard_address=None
        )
        client = Client(cluster)
    with client:
        return make_study(
            client, arguments.runner, study, options, out, arguments.shards, arguments.threads
        )


if __name__ == "__main__":
    sys.exit(main())
