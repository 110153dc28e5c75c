#!/usr/bin/env python3
r"""Draws docs/limit-cycle.png from two traces.

    for q in nearest error-feedback; do
      hil-runner run tests/cases/limit-cycle.toml --set controller.quantiser=$q \\
        --set run.duration_s=30 --trace out/$q.csv
    done
    python3 -m pip install matplotlib
    python3 docs/limit-cycle.py out/nearest.csv out/error-feedback.csv docs/limit-cycle.png
"""

import csv
import math
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

PITCH_M_PER_RAD = 5e-3 / (2 * math.pi)
GEAR_RATIO = 2.0
COUNTS_PER_RAD = 636.0
COUNT_UM = 1e6 * PITCH_M_PER_RAD * GEAR_RATIO / COUNTS_PER_RAD
FROM_S = 4.0
WINDOWS_S = ((4.0, 6.0), (6.0, 10.0), (10.0, 30.0))
CODES_S = 0.3


def read(path):
    """Time [s], deviation of the carriage [µm] and code of the rows from FROM_S on."""
    with open(path, newline="") as file:
        rows = [row for row in csv.DictReader(file) if float(row["t_s"]) >= FROM_S]
    time_s = [float(row["t_s"]) for row in rows]
    deviation_um = [
        1e6 * (PITCH_M_PER_RAD * float(row["gamma_rad"]) - float(row["x_ref_m"])) for row in rows
    ]
    return time_s, deviation_um, [int(row["dac_code"]) for row in rows]


def main(nearest, feedback, picture):
    plt.rcParams.update({"font.size": 10, "axes.grid": True, "grid.alpha": 0.3})
    figure, axes = plt.subplots(2, 2, figsize=(10, 5.4), sharey="row", height_ratios=[2, 1])
    for (upper, lower), path, name, colour in (
        (axes[:, 0], nearest, 'quantiser = "nearest"', "tab:red"),
        (axes[:, 1], feedback, 'quantiser = "error-feedback"', "tab:blue"),
    ):
        time_s, deviation_um, codes = read(path)
        mean = sum(codes) / len(codes)
        swings = []
        for begin_s, end_s in WINDOWS_S:
            window = [y for t, y in zip(time_s, deviation_um) if begin_s <= t <= end_s]
            swings.append(f"{max(window) - min(window):.2f} µm from {begin_s:g} to {end_s:g} s")
        print(f"{path}: swing {', '.join(swings)}; mean code {mean:.3f}")
        upper.plot(time_s, deviation_um, color=colour, linewidth=0.7)
        upper.set_title(f"{name}: {swings[-1]}", fontsize=11)
        upper.set_xlim(FROM_S, time_s[-1])
        lower.step(time_s, codes, where="post", color=colour, linewidth=1)
        lower.axhline(mean, color="black", linewidth=1, linestyle="--")
        lower.text(time_s[-1] - CODES_S, 14.2, f"  mean from 4 s on, dashed: {mean:.2f}")
        lower.set_xlim(time_s[-1] - CODES_S, time_s[-1])
        lower.set_xlabel(f"time [s]; codes of the last {CODES_S} s")
    axes[0, 0].set_ylabel("carriage − command [µm]")
    axes[0, 1].errorbar([15.0], [2.0], yerr=COUNT_UM / 2, color="black", capsize=4)
    axes[0, 1].text(15.6, 2.0, f"one encoder count: {COUNT_UM:.1f} µm", va="center")
    axes[1, 0].set_ylabel("DAC code")
    axes[1, 0].set_yticks(range(11, 15))
    axes[1, 0].set_ylim(10.6, 15.0)
    figure.tight_layout()
    figure.savefig(picture, dpi=110)


main(*sys.argv[1:4])
