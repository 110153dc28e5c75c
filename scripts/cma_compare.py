"""The own CMA-ES beside `cma` of PyPI: same problems, population, sigma and seeds.

scripts/python-check --all runs it with what the example `cma_medians` prints:

    cma_compare.py MEDIANS.json

Fails where a median of evaluations is above 1.3 times that of `cma`.
"""
import json
import multiprocessing
import statistics
import sys
import warnings

import cma
import numpy as np

warnings.filterwarnings("ignore")


def turned(x, centre):
    v = np.arange(1.0, len(x) + 1)
    return x - centre - 2 * v * (v @ (x - centre)) / (v @ v)


# Objective and violation.
PROBLEMS = {
    "sphere": lambda x: (np.sum((x - 0.3) ** 2), 0),
    "ellipsoid": lambda x: (np.sum(10 ** np.linspace(0, 6, len(x)) * turned(x, 0.4) ** 2), 0),
    "rosenbrock": lambda x: (rosen(4 * x - 2), 0),
    "boundary": lambda x: (np.sum((x - 0.3) ** 2) - 0.04 * len(x), 0.5 - np.mean(x)),
    "ridge": lambda x: (x[0] - 0.2, 0.2 + np.mean((x[1:] - 0.3) ** 2) - x[0]),
    "corner": lambda x: (np.arange(1, len(x) + 1) @ x, 0),
}


def rosen(z):
    return np.sum(100 * (z[1:] - z[:-1] ** 2) ** 2 + (1 - z[:-1]) ** 2)


def evaluations(name, target, n, population, seed):
    options = {"bounds": [0, 1], "popsize": population, "seed": seed, "verbose": -9}
    es = cma.CMAEvolutionStrategy(n * [0.5], 0.25, options)
    count = 0
    while count < 20_000:
        points, values = es.ask(), []
        for x in points:
            f, violation = PROBLEMS[name](np.asarray(x))
            count += 1
            if violation <= 0 and f <= target:
                return count
            # Infeasible ranked below feasible, by violation.
            values.append(1e3 + violation if violation > 0 else f)
        es.tell(points, values)
    return count


if __name__ == "__main__":
    worse = 0
    with multiprocessing.Pool() as pool:
        for row in json.load(open(sys.argv[1])):
            name, n, population = row["problem"], row["n"], row["population"]
            theirs = pool.starmap(evaluations, [(name, row["target"], n, population, seed) for seed in range(1, 21)])
            ratio = row["median"] / statistics.median(theirs)
            worse += ratio > 1.3
            print(f"{name:10} n {n:2} population {population:2}: {row['median']:5} ({row['least']} to {row['most']}), "
                  f"cma {statistics.median(theirs):6.0f} ({min(theirs)} to {max(theirs)}), ratio {ratio:.2f}"
                  + ("  ABOVE 1.3" if ratio > 1.3 else ""), flush=True)
    sys.exit(1 if worse else 0)
