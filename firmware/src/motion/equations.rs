//! The equations of planning, one operation a line, in the order in which they are made.
//!
//! ```text
//! v2 = (2/π)·t1/gain        V2 = C * T1;
//!                           V2 = V2 / GAIN;
//! ```
//!
//! An operation takes three bytes of a table, where a call with three numbers takes
//! sixteen: there are two hundred. Every number has a place ([`super::numbers`]).

/// Places of result and operands; the uppermost bits of the first two are the operation.
pub(super) type Equation = [u8; 3];

/// Equations that are made one after the other: the first, and how many.
#[derive(Debug, Clone, Copy)]
pub(super) struct Program {
    pub(super) first: u8,
    pub(super) count: u8,
}

/// Places from a number on, by their names.
macro_rules! places {
    ($first:expr;) => {};
    ($first:expr; $name:ident $($others:ident)*) => {
        #[allow(dead_code, reason = "a place that stays 0, or is looked at from a base on")]
        pub(super) const $name: u8 = $first;
        places! { $first + 1; $($others)* }
    };
}

/// Programs, and all of their equations one after the other.
macro_rules! programs {
    ($($(#[$doc:meta])* $program:ident {
        $($result:ident = $a:ident $operation:tt $b:ident;)*
    })*) => {
        programs! { @ 0; $($(#[$doc])* $program [$($result)*])* }

        pub(super) const EQUATIONS: &[Equation] = &[
            $($(programs!(@ $operation $result $a $b),)*)*
        ];
    };
    (@ $first:expr;) => {};
    (@ $first:expr; $(#[$doc:meta])* $program:ident [$($result:ident)*] $($others:tt)*) => {
        $(#[$doc])*
        pub(super) const $program: Program = Program {
            first: $first,
            count: 0 $(+ { let _ = $result; 1 })*,
        };
        programs! { @ $program.first + $program.count; $($others)* }
    };
    (@ + $result:ident $a:ident $b:ident) => { [$result, $a, $b] };
    (@ - $result:ident $a:ident $b:ident) => { [$result, 0x80 | $a, $b] };
    (@ * $result:ident $a:ident $b:ident) => { [0x80 | $result, $a, $b] };
    (@ / $result:ident $a:ident $b:ident) => { [0x80 | $result, 0x80 | $a, $b] };
}

/// Places below this one are counted from a base on.
pub(super) const RELATIVE: u8 = 8;

/// Places of an interval.
pub(super) const INTERVAL: u8 = 6;

// From the base of an interval on: its length, position and velocity at its start; the
// amplitude of an acceleration that is constant, and of a sine, the other being 0; the
// first sample after its start.
places! { 0; T X V A B FIRST }
// From a node on: its position, and the feed-forward behind the positions of all seven.
places! { 0; NODE }
places! { 7; AHEAD }
// All others, what is looked at by name first.
places! { RELATIVE;
    PERIOD END GAIN LOSS LEFT PEAK S K FOURTH SLOPE
    T1 X1 V1 A1 B1 FIRST1
    T2 X2 V2 A2 B2 FIRST2
    T3 X3 V3 A3 B3 FIRST3
    T4 X4 V4 A4 B4 FIRST4
    T5 X5 V5 A5 B5 FIRST5
    T6 X6 V6 A6 B6 FIRST6
    T7 X7 V7 A7 B7 FIRST7
    ZERO ONE TWO THREE SIX HALF C HALF_PI BEFORE LIMIT
    OMEGA P Q SPEED WIDTH BASE LINE BEND START PASSED
    THETA SINE COSINE SQUARE N DIVISOR
    KV KA KF TAU VELOCITY ACCELERATION LENGTH SIXTH PER
    THIRD CUBE COUNTS CODES
    N0 N1 N2 N3 N4 N5 N6
    F0 F1 F2 F3 F4 F5 F6
}

programs! {
    /// From the sample time, the longest duration 2^62, and c = 2/π, times 2^63.
    CONSTANTS {
        ONE = PERIOD / PERIOD;
        BEFORE = PERIOD - ONE;
        TWO = ONE + ONE;
        THREE = ONE + TWO;
        SIX = THREE * TWO;
        HALF = ONE / TWO;
        C = C / LIMIT;
        C = C * HALF;
        HALF_PI = ONE / C;
    }
    /// Length and samples of an interval. Its first sample is `n`, the end of the one
    /// before is `end`; sample `k` lies in it if start ≤ k·Δt < end.
    DIVIDE {
        // first = n − end/Δt
        FIRST = N * PERIOD;
        FIRST = FIRST - END;
        FIRST = FIRST / PERIOD;
        END = T + END;
        LEFT = LIMIT - END;
        // s = (end + Δt − 1)/Δt − ½, which is rounded to the next interval's n
        S = END + BEFORE;
        S = S / PERIOD;
        S = S - HALF;
        T = T / PERIOD;
    }
    /// The amplitudes that lead over the travel, which is in the peak's place, to rest.
    CHAIN {
        // gain = t2 + c·(t1 + t3): speed per amplitude, ∫ of a quarter sine is c·T
        GAIN = T1 + T3;
        GAIN = C * GAIN;
        GAIN = T2 + GAIN;
        // loss = t6 + c·(t5 + t7)
        LOSS = T5 + T7;
        LOSS = C * LOSS;
        LOSS = T6 + LOSS;
        // Speeds as parts of the peak: v2 = c·t1/gain, v3 = (t2 + c·t1)/gain
        V2 = C * T1;
        V3 = T2 + V2;
        V2 = V2 / GAIN;
        V3 = V3 / GAIN;
        V4 = ONE + ZERO;
        V5 = ONE + ZERO;
        // v6 = (t6 + c·t7)/loss, v7 = c·t7/loss
        V7 = C * T7;
        V6 = T6 + V7;
        V6 = V6 / LOSS;
        V7 = V7 / LOSS;
        // Positions at a peak of 1. A sine from or to rest: t·v·(1 − c)
        K = ONE - C;
        X2 = T1 * V2;
        X2 = X2 * K;
        // A ramp: t·(u + v)/2
        S = V2 + V3;
        S = T2 * S;
        S = S * HALF;
        X3 = X2 + S;
        // A sine to or from the peak: t·(v + c·(1 − v))
        S = ONE - V3;
        S = C * S;
        S = V3 + S;
        S = T3 * S;
        X4 = X3 + S;
        X5 = X4 + T4;
        S = ONE - V6;
        S = C * S;
        S = V6 + S;
        S = T5 * S;
        X6 = X5 + S;
        S = V6 + V7;
        S = T6 * S;
        S = S * HALF;
        X7 = X6 + S;
        S = T7 * V7;
        S = S * K;
        S = X7 + S;
        // peak = travel/x, and the amplitudes peak/gain, −peak/loss
        PEAK = PEAK / S;
        B1 = PEAK / GAIN;
        A2 = B1 + ZERO;
        B3 = B1 + ZERO;
        S = PEAK / LOSS;
        B5 = ZERO - S;
        A6 = ZERO - S;
        B7 = ZERO - S;
    }
    /// An interval: `ω = π/(2·T)`, `A/ω`, `S = A/ω²`, and `θ` at the first sample.
    ENTER {
        BASE = X * PEAK;
        LINE = V * PEAK;
        SLOPE = A + ZERO;
        BEND = B + ZERO;
        START = FIRST + ZERO;
        PASSED = ZERO + ZERO;
        S = T + ZERO;
        OMEGA = HALF_PI / S;
        SPEED = BEND / OMEGA;
        WIDTH = SPEED / OMEGA;
        FOURTH = BEND * OMEGA;
        FOURTH = FOURTH * OMEGA;
        THETA = OMEGA * START;
    }
    /// Beginning of `sin θ = θ·(1 − θ²/(2·3)·(1 − θ²/(4·5)·…))` and
    /// `cos θ = 1 − θ²/(1·2)·(1 − θ²/(3·4)·…)`.
    SERIES {
        SQUARE = THETA * THETA;
        SQUARE = ZERO - SQUARE;
        S = THETA + ZERO;
        SINE = THETA + ZERO;
        K = ONE + ZERO;
        COSINE = ONE + ZERO;
        N = TWO + ZERO;
    }
    /// Their next terms, each from the one before.
    TERMS {
        // k·(−θ²)/((n − 1)·n)
        DIVISOR = N - ONE;
        DIVISOR = DIVISOR * N;
        K = K * SQUARE;
        K = K / DIVISOR;
        COSINE = COSINE + K;
        // s·(−θ²)/(n·(n + 1))
        DIVISOR = N + ONE;
        DIVISOR = DIVISOR * N;
        S = S * SQUARE;
        S = S / DIVISOR;
        SINE = SINE + S;
        N = N + TWO;
    }
    /// `p = sin θ`, `q = cos θ`, and the line that the sine winds round has `v0 + A/ω`.
    RISE {
        P = SINE + ZERO;
        Q = COSINE + ZERO;
        LINE = LINE + SPEED;
    }
    /// A fall is a rise a quarter wave later: `p = cos θ`, `q = −sin θ`, from `x0 + S` on.
    FALL {
        P = COSINE + ZERO;
        Q = ZERO - SINE;
        BASE = BASE + WIDTH;
    }
    /// The largest acceleration of an interval.
    LARGEST {
        S = SLOPE + BEND;
    }
    /// That of its first sample.
    ONLY {
        S = BEND * P;
        S = SLOPE + S;
    }
    /// `|f‴| ≤ A·ω²·(Kv + Ka·ω)`, and the bounds in whole numbers rounded down.
    BOUNDS {
        THIRD = KA * OMEGA;
        THIRD = KV + THIRD;
        THIRD = FOURTH * THIRD;
        CODES = SIX + ONE;
        COUNTS = THREE * THREE;
        COUNTS = COUNTS * COUNTS;
        COUNTS = COUNTS * THREE;
    }
    /// 243 − |x⁗|·N⁴ and 7 − |f‴|·N³.
    FITS {
        CUBE = N * N;
        CUBE = CUBE * N;
        S = FOURTH * CUBE;
        S = S * N;
        S = COUNTS - S;
        K = THIRD * CUBE;
        K = CODES - K;
    }
    /// A stretch, from `τ` of the interval on.
    BEGIN {
        SIXTH = LENGTH / SIX;
        THETA = OMEGA * SIXTH;
        TAU = START + PASSED;
        PASSED = PASSED + LENGTH;
    }
    /// The command at `τ`.
    COMMAND {
        // x = x0 + (v0 + A·τ/2)·τ − S·p, where one of A and S is 0
        VELOCITY = SLOPE * TAU;
        VELOCITY = LINE + VELOCITY;
        S = LINE + VELOCITY;
        S = S * HALF;
        S = S * TAU;
        S = BASE + S;
        K = WIDTH * P;
        NODE = S - K;
        // v = v0 + A·τ − (A/ω)·q, a = A + A·p
        K = SPEED * Q;
        VELOCITY = VELOCITY - K;
        ACCELERATION = BEND * P;
        ACCELERATION = SLOPE + ACCELERATION;
        // f = Kv·v + Ka·a + Kf
        K = KV * VELOCITY;
        S = KA * ACCELERATION;
        S = K + S;
        AHEAD = S + KF;
    }
    /// To the next node, a sixth of the stretch on.
    TURN {
        TAU = TAU + SIXTH;
        // p = p·cos + q·sin, q = q·cos − p·sin
        S = Q * SINE;
        K = P * SINE;
        P = P * COSINE;
        P = P + S;
        Q = Q * COSINE;
        Q = Q - K;
    }
    /// The stretch in the places of the nodes: of the position its value at the first
    /// sample and three differences of a sample, of the feed-forward two.
    DIFFERENCES {
        // First, second and third difference x1, x2, x3 of a third.
        N6 = N6 - N4;
        N4 = N4 - N2;
        N2 = N2 - N0;
        N6 = N6 - N4;
        N4 = N4 - N2;
        N6 = N6 - N4;
        PER = THREE / LENGTH;
        // In powers of a sample, x0 + c1·k + c2·k² + c3·k³: c3 = x3/6
        N3 = N6 / SIX;
        N3 = N3 * PER;
        N3 = N3 * PER;
        N3 = N3 * PER;
        // c1 = x1 − x2/2 + x3/3
        N4 = N4 * HALF;
        N1 = N2 - N4;
        S = N6 / THREE;
        N1 = N1 + S;
        N1 = N1 * PER;
        // c2 = x2/2 − x3/2
        S = N6 * HALF;
        N4 = N4 - S;
        N4 = N4 * PER;
        N4 = N4 * PER;
        // v = c1 + c2 + c3, j = 6·c3, a = 2·c2 + j
        N1 = N1 + N4;
        N1 = N1 + N3;
        N3 = N3 * SIX;
        N2 = N4 * TWO;
        N2 = N2 + N3;
        // Of the feed-forward over halves: d2 = f2/2, d1 = f1 − f2/2
        N6 = F6 - F3;
        N5 = F3 - F0;
        N6 = N6 - N5;
        PER = TWO / LENGTH;
        N6 = N6 * HALF;
        N5 = N5 - N6;
        N5 = N5 * PER;
        N6 = N6 * PER;
        N6 = N6 * PER;
        // Change d1 + d2, and growth 2·d2.
        N5 = N5 + N6;
        N6 = N6 * TWO;
        N4 = F0 + ZERO;
    }
}
