#!/usr/bin/env python3
"""Hold what workers are given against what the command line meant, from another
folder than the one it was given in. Needs no Dask.

    cluster/test_paths.py path/to/hil-runner
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import dask_study

STUDY = """
base = "paper-1"
[set]
run.duration_s = 0.1
"""


def main():
    runner = str(Path(sys.argv[1]).resolve())
    with tempfile.TemporaryDirectory() as folder:
        here, elsewhere = Path(folder, "here").resolve(), Path(folder, "elsewhere")
        here.mkdir()
        elsewhere.mkdir()
        case = subprocess.run([runner, "init", "paper-2"], check=True, stdout=subprocess.PIPE).stdout
        (here / "own.toml").write_bytes(case)
        (here / "own-study.toml").write_text(STUDY)
        # Beside a file of its name a built-in case is the built-in case all the same.
        (here / "paper-3").write_text("no run file")
        (here / "backlash").write_text("no study")
        os.chdir(here)
        given = {
            ("own-study.toml", "own.toml"): (here / "own-study.toml", here / "own.toml"),
            ("./own-study.toml", "../here/own.toml"): (here / "own-study.toml", here / "own.toml"),
            ("own-study.toml", "paper-3"): (here / "own-study.toml", "paper-3"),
            ("backlash", "paper-3"): ("backlash", "paper-3"),
        }
        made = []
        for (study, base), meant in given.items():
            words = [study, "--base", base, "--out", "out", "--runner", runner, "--set", "controller.kp=3"]
            study, options = dask_study.study_and_options(dask_study.parser().parse_args(words))
            wanted = ["--base", str(meant[1]), "--set", "controller.kp=3"]
            assert (study, options) == (str(meant[0]), wanted), (study, options)
            made.append((study, options))
        os.chdir(elsewhere)
        dask_study.make_shard(runner, *made[0], 1, 1, str(elsewhere / "out"), 1)
        assert (elsewhere / "out" / "results.csv").exists()
        # The contrast: the path as it was given leads nowhere from here.
        try:
            dask_study.make_shard(runner, made[0][0], ["--base", "own.toml"], 1, 1, "other", 1)
        except RuntimeError as error:
            assert "own.toml: there is no such file" in str(error), error
        else:
            raise AssertionError("own.toml was found from another folder")
    print("paths of study and base: the same from any folder")


if __name__ == "__main__":
    main()
