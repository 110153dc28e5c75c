"""Figures of linear loops against python-control, which makes them from the equations
of motion and a model of its own: scripts/python-check runs it.

    python3 scripts/control_margins.py COMMAND ...

COMMAND reads a line for each case, the name of a built-in one and overrides KEY=VALUE
between blanks, and answers each with a line of JSON: the figures by their keys.
"""

import json
import math
import random
import subprocess
import sys
import tomllib
from pathlib import Path

import control
import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq

CASES = Path(__file__).resolve().parent.parent / "cases"
# Largest relative difference of a figure, and absolute of one in dB or degrees.
MOST = 1e-5
RANDOM = 24
# Frequencies between which control interpolates.
POINTS = 4000


def held_plant(v, joint):
    """(A, B, C): states of the axis and the last code; outputs the position that K_p
    and K_i see and the motor's angle, in radians of the motor."""
    z, p = v["transmission.gear_ratio"], 1e-3 * v["transmission.screw_pitch_mm_per_rev"] / math.tau
    km, r, l = (v["motor." + key] for key in ("torque_constant_nm_per_a", "resistance_ohm", "inductance_h"))
    j1 = v["motor.inertia_kg_m2"] / z**2
    j2 = v["transmission.screw_inertia_kg_m2"] + v["carriage.mass_kg"] * p**2
    k, c = v["transmission.stiffness_nm_per_rad"], v["transmission.damping_nms_per_rad"]
    drag = p * v["carriage.resistance_linear_ns_per_rad"]
    # beta, its rate, gamma, its rate, then the drive's own
    if joint == "contact":
        a = np.array([
            [0, 1, 0, 0],
            [-k / j1, -c / j1, k / j1, c / j1],
            [0, 0, 0, 1],
            [k / j2, c / j2, -k / j2, -(c + drag) / j2],
        ])
        torque = np.array([0, 1 / j1, 0, 0])
    else:
        a, torque = np.array([[0.0, 1], [0, 0]]), np.array([0, 1 / j1])
    n = len(a)
    bandwidth = v.get("drive.current_bandwidth_hz")
    if v["drive.kind"] == "voltage":
        a = np.block([[a, (torque * km / z)[:, None]], [np.zeros((1, n)), -np.ones((1, 1)) * r / l]])
        a[n, 1] = -km / z / l
        b = np.append(np.zeros(n), 1 / l)
    elif bandwidth:
        # V = L*w*(u - I) + R*w*q, q' = u - I
        w = math.tau * bandwidth
        a = np.block([[a, np.outer(torque * km / z, [1, 0])], [np.zeros((2, n + 2))]])
        a[n, 1], a[n, n], a[n, n + 1] = -km / z / l, -r / l - w, w * r / l
        a[n + 1, n] = -1
        b = np.append(np.zeros(n), [w, 1])
    else:
        b = torque * km / z
    dt, delay = v["controller.sample_time_s"], v["controller.computation_delay_s"]
    n = len(a)

    def held(t):
        m = np.zeros((n + 1, n + 1))
        m[:n, :n], m[:n, n] = a * t, b * t
        e = expm(m)
        return e[:n, :n], e[:n, n]

    phi1, gamma1 = held(delay)
    phi2, gamma2 = held(dt - delay)
    big = np.zeros((n + 1, n + 1))
    big[:n, :n], big[:n, n] = phi2 @ phi1, phi2 @ gamma1
    dual = v["controller.feedback"] == "dual"
    outputs = np.zeros((2, n + 1))
    outputs[0, 2 if dual else 0] = outputs[1, 0] = 1 / z
    return big, np.append(gamma2, 1.0)[:, None], outputs


def open_loop(v, joint):
    """L, broken at the code, as a state space."""
    dt = v["controller.sample_time_s"]
    k0 = v["encoder.counts_per_rad"] * v["drive.dac_lsb_v"] * v["drive.amplifier_gain"]
    kp, ki, kd = (k0 * v["controller." + key] for key in ("kp", "ki_per_s", "kd_s"))
    a = dt / (v["controller.derivative_filter_s"] + dt)
    s = control.tf([1, 0], [1, -1], dt)  # of the sum that has the present error
    held = control.ss(control.tf([kp], [1], dt)) + control.ss(ki * dt * s)
    motor = control.ss(control.tf([kd / dt * a, -kd / dt * a], [1, -(1 - a)], dt))
    law = control.append(held, motor)
    law = control.ss(law.A, law.B, np.ones((1, 2)) @ law.C, np.ones((1, 2)) @ law.D, dt)
    big, b, c = held_plant(v, joint)
    return law * control.ss(big, b, c, 0, dt)


def response(system, omega):
    """At all frequencies at once; a call of the system takes them one by one."""
    z = np.exp(1j * np.atleast_1d(omega) * system.dt)
    x = np.linalg.solve(z[:, None, None] * np.eye(len(system.A)) - system.A, system.B[None].astype(complex))
    return (system.C @ x + system.D)[:, 0, 0]


def minimum(f, low, high):
    ratio = (math.sqrt(5) - 1) / 2
    for _ in range(80):
        x, y = high - ratio * (high - low), low + ratio * (high - low)
        low, high = (low, y) if f(x) < f(y) else (x, high)
    return f((low + high) / 2)


def over_frequency(loop):
    """Frequencies up to half of the sample rate, L at them, and |1 + L| at its least."""
    omega = np.logspace(-1, math.log10(math.pi / loop.dt), POINTS)
    omega[-1] = math.pi / loop.dt * (1 - 1e-15)
    values = response(loop, omega)
    i = int(np.argmin(np.abs(1 + values)))
    distance = lambda w: abs(1 + complex(response(loop, w)[0]))
    return omega, values, minimum(distance, omega[max(i - 1, 0)], omega[min(i + 1, len(omega) - 1)])


def wanted(v, joint):
    """The figures of a joint state by python-control's own functions."""
    dt = v["controller.sample_time_s"]
    loop = open_loop(v, joint)
    closed = control.feedback(loop, 1)
    poles = np.abs(control.poles(closed))
    stable = bool(np.max(poles) < 1)
    at = lambda w: complex(response(loop, w)[0])
    # control's margins from the response at many frequencies, then its own root search on L.
    omega, over_omega, modulus = over_frequency(loop)
    frd = control.frd(over_omega, omega, smooth=True, dt=dt)
    gains, phases, _, _, crossings, _ = control.stability_margins(frd, returnall=True)
    above = [gain for gain in gains if gain > 1]
    # In the middle of the spectrum L is real, which the search for a sign misses.
    if over_omega[-1].real < 0 and -1 / over_omega[-1].real > 1:
        above.append(-1 / over_omega[-1].real)
    falls = [w for w in crossings if abs(at(w * 0.999)) > 1]
    names = {
        "modulus_margin_{}": modulus if stable else -modulus,
        "gain_margin_{}_db": 20 * math.log10(min(above)) if stable and above else None,
        "phase_margin_{}_deg": min(phases, key=abs, default=None) if stable else None,
        "crossover_{}_hz": min(falls) / math.tau if falls else None,
        "bandwidth_{}_hz": None,
    }
    if stable:
        # control.bandwidth takes a sampled system at jw instead of e^(jw dt).
        over = lambda w: abs(complex(response(closed, w)[0])) - math.sqrt(0.5)
        below = np.nonzero(np.abs(response(closed, omega)) < math.sqrt(0.5))[0]
        if len(below) > 0:
            w = brentq(over, omega[below[0] - 1], omega[below[0]], xtol=1e-12, rtol=1e-12)
            names["bandwidth_{}_hz"] = w / math.tau
    return {key.format(joint): value for key, value in names.items()}, float(np.max(poles))


def values(name, sets):
    with open(CASES / f"{name}.toml", "rb") as file:
        tables = tomllib.load(file)
    v = {
        "carriage.resistance_linear_ns_per_rad": 0.0,
        "drive.kind": "voltage",
        "controller.computation_delay_s": 0.0,
        "controller.derivative_filter_s": 0.0,
        "controller.feedback": "motor",
    }
    v |= {f"{table}.{key}": value for table, keys in tables.items() if isinstance(keys, dict) for key, value in keys.items()}
    v |= sets
    v["drive.amplifier_gain"] = v.get("drive.amplifier_gain_a_per_v", v["drive.amplifier_gain"])
    return v


DUAL = {"controller.feedback": "dual", "controller.derivative": "measurement", "load_encoder.counts_per_rad": 1600.0}


def current(bandwidth_hz=None):
    sets = {"drive.kind": "current", "drive.amplifier_gain_a_per_v": 0.8, "drive.current_limit_a": 20.0}
    return sets | ({"drive.current_bandwidth_hz": bandwidth_hz} if bandwidth_hz else {})


def cases():
    options = [
        {},
        {"controller.derivative_filter_s": 0.0005},
        {"controller.computation_delay_s": 0.0004},
        {"controller.sample_time_s": 0.004},
        DUAL,
        DUAL | {"controller.derivative_filter_s": 0.001, "controller.computation_delay_s": 0.001},
        current(),
        current(1000.0) | {"controller.derivative_filter_s": 0.0005},
    ]
    for name in ("paper-1", "paper-2", "paper-3", "paper-4"):
        for sets in options:
            yield name, sets
    draw = random.Random(21)
    for trial in range(RANDOM):
        size = lambda value, factor: float(f"{value * factor ** draw.uniform(-1, 1):.6g}")
        dt = draw.choice([0.0002, 0.0005, 0.001, 0.002, 0.005])
        sets = {
            "motor.inertia_kg_m2": size(2e-4, 4),
            "motor.torque_constant_nm_per_a": size(0.25, 2),
            "motor.resistance_ohm": size(1.5, 3),
            "motor.inductance_h": size(6.5e-3, 4),
            "transmission.gear_ratio": size(2.0, 3),
            "transmission.stiffness_nm_per_rad": size(350.0, 10),
            "transmission.damping_nms_per_rad": size(0.2, 4),
            "transmission.screw_inertia_kg_m2": size(8.5e-4, 3),
            "carriage.mass_kg": size(50.0, 4),
            "carriage.resistance_linear_ns_per_rad": size(1.0, 10),
            "controller.kp": size(3.2, 4),
            "controller.ki_per_s": size(5.0, 4),
            "controller.kd_s": size(0.05, 4),
            "controller.sample_time_s": dt,
            "controller.computation_delay_s": draw.choice([0.0, dt / 4, dt]),
            "controller.derivative_filter_s": draw.choice([0.0, dt / 2, 2 * dt]),
        }
        sets |= draw.choice([{}, DUAL])
        sets |= draw.choice([{}, {}, current(), current(size(1000.0, 2))])
        yield f"paper-{trial % 4 + 1}", sets


def main(command):
    asked = list(cases())
    lines = [" ".join([name] + [f"{key}={value}" for key, value in sets.items()]) for name, sets in asked]
    answers = subprocess.run(command, input="\n".join(lines) + "\n", text=True, stdout=subprocess.PIPE, check=True)
    answers = [json.loads(line) for line in answers.stdout.splitlines()]
    assert len(answers) == len(asked), (len(answers), len(asked))
    worst, unstable, compared, wrong, blind = {}, 0, 0, [], 0
    for (name, sets), line, found in zip(asked, lines, answers):
        v = values(name, sets)
        joints = ["contact"] if v["controller.feedback"] == "dual" else ["contact", "gap"]
        if len(joints) == 1:
            assert found["modulus_margin_gap"] is None, line
        for joint in joints:
            figures, radius = wanted(v, joint)
            unstable += radius >= 1
            for key, value in figures.items():
                has = found[key]
                if (value is None) != (has is None):
                    wrong.append(f"{key} {has}, by control {value}: {line} ({joint})")
                    continue
                if value is None:
                    continue
                compared += 1
                off = abs(has - value) / (1 if key.endswith(("db", "deg")) else abs(value))
                worst[key] = max(worst.get(key, (0, "")), (off, line))
                if off > MOST:
                    wrong.append(f"{key} {has}, by control {value}: {line} ({joint})")
            # The contrast: a tenth of a sample more of delay is another loop.
            if v["controller.computation_delay_s"] < v["controller.sample_time_s"]:
                late = dict(v)
                late["controller.computation_delay_s"] += 0.1 * v["controller.sample_time_s"]
                if late["controller.computation_delay_s"] <= v["controller.sample_time_s"]:
                    *_, other = over_frequency(open_loop(late, joint))
                    blind += abs(abs(found[f"modulus_margin_{joint}"]) - other) <= MOST * other
    print(f"{len(asked)} cases, {compared} figures, {unstable} unstable loops; largest differences:")
    for key, (off, line) in sorted(worst.items()):
        unit = "dB" if key.endswith("db") else "deg" if key.endswith("deg") else "of the figure"
        print(f"  {key:30} {off:.1e} {unit:14} {line[:60]}")
    for line in wrong:
        print("WRONG", line)
    assert blind == 0, f"a tenth of a sample more of delay is not seen in {blind} loops"
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main(sys.argv[1:])
