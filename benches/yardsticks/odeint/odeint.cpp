// The paper's elastic axis (eq. 8-11, 14-15, 25) solved by Boost odeint's
// runge_kutta_dopri5 with error control, in lockstep with a sampled law (W1, W2)
// or under the continuous law (W3). A change of contact ends a step; it is found
// by bisection on the step's own dense output.
//
//   g++ -std=c++17 -O3 -march=native -DNDEBUG -o odeint odeint.cpp     (Boost headers: libboost-dev)
//   odeint ROUNDS <case.txt
//
// case.txt has a name and its numbers in every line; the benches write it
// (../odeint.rs). The first run is not counted. Printed are `ns` of every round,
// their median and least, the changes of contact, a sum that tells the codes and
// the state at the end.

#include <algorithm>
#include <array>
#include <boost/numeric/odeint.hpp>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace odeint = boost::numeric::odeint;

// γ, γ̇, ε, ε̇, I and, under the continuous law, β̂ = ∫β dt.
template <std::size_t N> using State = std::array<double, N>;
constexpr int EPSILON = 2, EPSILON_DOT = 3, CURRENT = 4, BETA_INTEGRAL = 5;

using Numbers = std::map<std::string, std::vector<double>>;

struct Axis {
    double z, per_both, per_screw, current_to_beta_ddot, per_inductance, resistance_rate, emf_rate;
    double k, c, b;
    int flank = 0; // −1, 0 (the gap) or 1

    explicit Axis(Numbers &in)
        : z(in["gear_ratio"][0]), k(in["stiffness_nm_per_rad"][0]),
          c(in["damping_nms_per_rad"][0]), b(in["backlash_half_rad"][0]) {
        const double j1 = in["gear_inertia_kg_m2"][0], j2 = in["screw_inertia_kg_m2"][0];
        const double km = in["torque_constant_nm_per_a"][0], l = in["inductance_h"][0];
        per_both = 1 / j1 + 1 / j2;
        per_screw = 1 / j2;
        current_to_beta_ddot = km / (z * j1);
        per_inductance = 1 / l;
        resistance_rate = in["resistance_ohm"][0] / l;
        emf_rate = km / (z * l);
    }

    template <class S> void rates(const S &y, S &dy, double voltage_v) const {
        const double psi = flank ? k * (y[EPSILON] - flank * b) + c * y[EPSILON_DOT] : 0;
        dy[0] = y[1];
        dy[1] = per_screw * psi;
        dy[EPSILON] = y[EPSILON_DOT];
        dy[EPSILON_DOT] = current_to_beta_ddot * y[CURRENT] - per_both * psi;
        dy[CURRENT] = per_inductance * voltage_v - resistance_rate * y[CURRENT] -
                      emf_rate * (y[1] + y[EPSILON_DOT]);
    }

    // Positive within the mode.
    double guard(double epsilon) const {
        return flank ? flank * epsilon - b : b - std::abs(epsilon);
    }
};

// The axis and its solver from rest. `System` fills in the rates at a time.
template <std::size_t N, class System> struct Driven {
    using Y = State<N>;
    using Stepper = odeint::runge_kutta_dopri5<Y, double, Y, double, odeint::array_algebra>;
    using Checker = odeint::default_error_checker<double, odeint::array_algebra, odeint::default_operations>;

    static constexpr double FIRST_STEP_S = 1e-5;

    Axis &axis;
    System system;
    odeint::controlled_runge_kutta<Stepper, Checker> stepper;
    Y y{}, dy{}, next{}, next_dy{};
    double time_s = 0;
    double wanted_s = FIRST_STEP_S; // what the error control would take
    int changes = 0;
    double codes = 0; // Σ number·code of the samples

    Driven(Axis &axis, System system, double tolerance)
        : axis(axis), system(system), stepper(Checker(tolerance, tolerance)) {}

    void advance(double end_s) {
        bool fresh = false;
        while (time_s < end_s) {
            const double left_s = end_s - time_s;
            // A sliver would cost as much as a whole step.
            const bool last = wanted_s >= 0.95 * left_s;
            double t = time_s, h = last ? left_s : wanted_s;
            while (stepper.try_step(system, y, dy, t, next, next_dy, h) == odeint::fail)
                wanted_s = h;
            const bool arrived = end_s - t <= 1e-9 * left_s;
            // A step that the end cut short says nothing against longer ones.
            if (!(last && arrived && h < wanted_s)) wanted_s = h;
            if (axis.guard(next[EPSILON]) >= 0) {
                fresh = false;
                y = next;
                dy = next_dy;
                time_s = arrived ? end_s : t;
                continue;
            }
            if (fresh) {
                std::fprintf(stderr, "a contact was missed at %.9f s\n", t);
                std::exit(1);
            }
            change(t);
            fresh = true;
        }
    }

    // Ends the step before `t` at its change of contact and starts again there.
    void change(double t) {
        Y there;
        double low = time_s, high = t;
        while (true) {
            const double middle = 0.5 * (low + high);
            if (middle <= low || middle >= high) break;
            stepper.stepper().calc_state(middle, there, y, dy, time_s, next, next_dy, t);
            (axis.guard(there[EPSILON]) < 0 ? high : low) = middle;
        }
        // The step itself up to there: more exact than its dense output.
        stepper.stepper().do_step(system, y, dy, time_s, next, next_dy, high - time_s);
        y = next;
        const int before = axis.flank;
        axis.flank = before ? 0 : (y[EPSILON] > 0 ? 1 : -1);
        y[EPSILON] = (before + axis.flank) * axis.b;
        time_s = high;
        system(y, dy, time_s);
        ++changes;
    }
};

struct Result {
    std::array<double, 5> y;
    int changes;
    double codes;
};

template <class D> Result result(const D &d) {
    Result r{{}, d.changes, d.codes};
    std::copy_n(d.y.begin(), r.y.size(), r.y.begin());
    return r;
}

// Rounded by itself: fused with a sum, it could end on the other side of a tie
// between two codes. GCC has no other way for a part of a file.
__attribute__((noinline)) double product(double a, double b) { return a * b; }

// The law in the order of lockstep.rs, a voltage held for each sample.
Result sampled(Numbers &in) {
    Axis axis(in);
    const double kp = in["kp"][0], ki = in["ki_per_s"][0], kd = in["kd_s"][0];
    const double period_s = in["sample_time_s"][0], counts = in["counts_per_rad"][0];
    const double lowest = in["codes"][0], highest = in["codes"][1];
    const double step_v = in["dac_step_v"][0], gain = in["amplifier_gain"][0];
    const double limit_v = in["voltage_limit_v"][0];
    double voltage_v = 0, sum = 0, previous = 0;
    auto rates = [&](const State<5> &y, State<5> &dy, double) { axis.rates(y, dy, voltage_v); };
    Driven<5, decltype(rates)> d(axis, rates, in["tolerance"][0]);
    const std::vector<double> &setpoints = in["setpoints"];
    for (std::size_t tick = 0; tick + 1 < setpoints.size(); ++tick) {
        const double alpha_rad = (d.y[0] + d.y[EPSILON]) / axis.z;
        const double e = setpoints[tick] - std::floor(counts * alpha_rad);
        if (tick == 0) previous = e;
        sum += product(e, period_s);
        const double out =
            product(kp, e) + product(ki, sum) + product(kd, e - previous) / period_s;
        previous = e;
        const double code = std::clamp(std::floor(out + 0.5), lowest, highest);
        d.codes += double(tick + 1) * code;
        voltage_v = std::clamp(gain * (step_v * code), -limit_v, limit_v);
        // Of the rates only the current's jumps: the rest is the last stage's.
        rates(d.y, d.dy, d.time_s);
        d.advance(double(tick + 1) * period_s);
    }
    return result(d);
}

// The law of eq. 27-31; the command is smooth within a segment.
Result continuous(Numbers &in) {
    Axis axis(in);
    const std::vector<double> &law = in["law"], &segments = in["segments"];
    const double limit_v = in["voltage_limit_v"][0];
    const double *s = nullptr; // start, length, a_sin, a_one, a_cos, v, r, r̂; angles of the gear
    auto rates = [&](const State<6> &y, State<6> &dy, double time_s) {
        const double t = time_s - s[0], w = M_PI_2 / s[1];
        const double sin = std::sin(w * t), half = std::sin(w * t / 2), versine = 2 * half * half;
        const double late = (t - sin / w) / w, turned = versine / (w * w);
        const double v = s[5] + s[2] * versine / w + s[3] * t + s[4] * sin / w;
        const double r = s[6] + s[5] * t + s[2] * late + s[3] * t * t / 2 + s[4] * turned;
        const double r_hat = s[7] + s[6] * t + s[5] * t * t / 2 + s[2] * (t * t / 2 - turned) / w +
                             s[3] * t * t * t / 6 + s[4] * late / w;
        const double beta = y[0] + y[EPSILON], beta_dot = y[1] + y[EPSILON_DOT];
        const double demand =
            law[0] * (r - beta) + law[1] * (r_hat - y[BETA_INTEGRAL]) + law[2] * (v - beta_dot);
        axis.rates(y, dy, std::clamp(demand, -limit_v, limit_v));
        dy[BETA_INTEGRAL] = beta;
    };
    Driven<6, decltype(rates)> d(axis, rates, in["tolerance"][0]);
    for (std::size_t i = 0; i < segments.size(); i += 8) {
        s = &segments[i];
        rates(d.y, d.dy, d.time_s);
        d.advance(s[0] + s[1]);
    }
    return result(d);
}

int main(int argc, char **argv) {
    const int rounds = argc > 1 ? std::atoi(argv[1]) : 20;
    Numbers in;
    for (std::string line; std::getline(std::cin, line);) {
        std::istringstream words(line);
        std::string name;
        words >> name;
        for (double number; words >> number;) in[name].push_back(number);
    }
    Result last{};
    std::vector<double> ns;
    for (int round = 0; round <= rounds; ++round) {
        const auto start = std::chrono::steady_clock::now();
        last = in.count("setpoints") ? sampled(in) : continuous(in);
        const auto taken = std::chrono::steady_clock::now() - start;
        if (round) ns.push_back(std::chrono::duration<double, std::nano>(taken).count());
    }
    std::printf("ns");
    for (double n : ns) std::printf(" %.0f", n);
    std::sort(ns.begin(), ns.end());
    if (!ns.empty()) std::printf("\nmedian_ns %.0f\nleast_ns %.0f", ns[ns.size() / 2], ns[0]);
    std::printf("\nchanges %d\ncodes %.17g\nstate", last.changes, last.codes);
    for (double y : last.y) std::printf(" %.17g", y);
    std::printf("\n");
}
