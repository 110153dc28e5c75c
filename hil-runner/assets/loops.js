import { extent, FREQUENCY, minus, reading } from "./chart.js";

// Pictures of the linear loop L(e^{jωΔt}): Bode, Nyquist, Nichols, and the stiffness.

// 1/M_s that is asked of |1 + L|: a circle around −1.
/** @import { Curve } from "./chart.js" */
/**
 * @typedef {{ frequency_hz: number[], re: number[], im: number[], stiffness_n_per_um: number[] | null }} LoopCurve
 * @typedef {{ loops: { name: string, curves: Record<string, LoopCurve | null> }[], notes: string[] }} LoopReport
 * @typedef {{ label: string, of: string, curve: LoopCurve, look: { colour: string, dash?: number[] } }} Loop
 */

const MODULUS = 0.5;
const DEGREES = 180 / Math.PI;

/** @param {number[]} re @param {number[]} im */
export const decibels = (re, im) => re.map((x, i) => 20 * Math.log10(Math.hypot(x, im[i])));

// The phase of L in degrees, at the low end between −270 and 90, from there on without
// jumps.
/** @param {number[]} re @param {number[]} im */
export function phases(re, im) {
  let before = -90;
  return re.map((x, i) => {
    const phase = Math.atan2(im[i], x) * DEGREES;
    before = phase + 360 * Math.round((before - phase) / 360);
    return before;
  });
}

// |1 + L| = 1/M_s: L = −1 + e^{jφ}/M_s. It does not go around 0, so that its phase comes back.
export function modulusCircle(points = 120) {
  const angles = Array.from({ length: points + 1 }, (_, i) => (2 * Math.PI * i) / points);
  return {
    re: angles.map((angle) => -1 + MODULUS * Math.cos(angle)),
    im: angles.map((angle) => MODULUS * Math.sin(angle)),
  };
}

// The loops of a figure: { label, of, curve, look } for each joint state of each set of gains of
// each run; all but the last run and the last gains are dashed.
/** @param {{ name: string, loop_curves: LoopReport | null }[]} runs */
export function loopsOf(runs) {
  /** @type {Loop[]} */
  const loops = [];
  runs.forEach(({ name, loop_curves }, run) => {
    (loop_curves?.loops ?? []).forEach((set, i, sets) => {
      const now = run === runs.length - 1 && i === sets.length - 1;
      const look = now ? {} : { dash: run === runs.length - 1 ? [2, 3] : [6, 4] };
      const words = [runs.length > 1 && name, set.name].filter(Boolean);
      for (const [joint, label, colour] of [["contact", "in contact", "c-carriage"], ["gap", "in the gap", "c-vermilion"]]) {
        const curve = set.curves[joint];
        const of = [...words, joint].join(", ");
        if (curve) loops.push({ label: [...words, label].join(", "), of, curve, look: { ...look, colour } });
      }
    });
  });
  return loops;
}

// Curves over frequency.
/** @param {Loop[]} loops @param {string} column @param {string} unit @param {(curve: LoopCurve) => number[] | null} y @returns {Curve[]} */
function overFrequency(loops, column, unit, y) {
  return loops.flatMap(({ label, of, curve, look }) => {
    const values = y(curve);
    return values ? [{ t: curve.frequency_hz, y: values, column, of, label, unit, ...look }] : [];
  });
}

/** @type {Record<string, (loops: Loop[]) => any>} */
export const loopPlots = {
  bode_gain: (loops) => ({
    over: FREQUENCY,
    curves: overFrequency(loops, "gain_db", "dB", ({ re, im }) => decibels(re, im)),
    yLabel: "|L| [dB]",
  }),
  bode_phase: (loops) => ({
    over: FREQUENCY,
    curves: overFrequency(loops, "phase_deg", "°", ({ re, im }) => phases(re, im)),
    yLabel: "arg L [°]",
    ySteps: [5, 15, 30, 45, 90, 180, 360, 720],
    limits: [{ value: -180, label: "−180°" }],
  }),
  stiffness: (loops) => {
    const curves = overFrequency(loops, "stiffness_n_per_um", "N/µm", (curve) => curve.stiffness_n_per_um);
    const least = extent(...curves.map(({ y }) => y))[0];
    const limits = [{ value: least, label: `least ${reading(least, "N/µm")}`, colour: "muted" }];
    return {
      over: FREQUENCY,
      curves,
      yLabel: "|F/x| [N/µm]",
      yLog: true,
      limits: curves.length === 1 ? limits : [],
      missing: "An unstable loop has no stiffness.",
    };
  },
  nyquist: (loops) => {
    const { re, im } = modulusCircle();
    const [far, near, none] = [-1.06, -0.94, null];
    const plane = loops.map(({ label, of, curve, look }) => ({
      f: curve.frequency_hz, x: curve.re, y: curve.im, of, label, ...look,
    }));
    const circle = { x: re, y: im, label: `|1 + L| = ${MODULUS} (M_s = ${1 / MODULUS})`, ...REQUIRED };
    const one = { x: [far, near, none, -1, -1], y: [0, 0, none, -0.06, 0.06], label: "−1", ...CRITICAL };
    return {
      curves: [...plane, circle, one],
      x: { label: "Re L", range: [-3, 2], steps: [0.5, 1, 2, 5] },
      y: { label: "Im L", range: [-2.5, 2.5], steps: [0.5, 1, 2, 5] },
      square: true,
      columns: ["re", "im"],
      read: (/** @type {number} */ x, /** @type {number} */ y) => minus(`${+x.toPrecision(3)}`) + (y < 0 ? " − " : " + ") + `${+Math.abs(y).toPrecision(3)}j`,
    };
  },
  nichols: (loops) => {
    const plane = loops.map(({ label, of, curve, look }) => ({
      f: curve.frequency_hz, x: phases(curve.re, curve.im), y: decibels(curve.re, curve.im), of, label, ...look,
    }));
    const { re, im } = modulusCircle();
    const required = { x: phases(re, im), y: decibels(re, im), label: `M_s = ${1 / MODULUS}`, ...REQUIRED };
    const one = {
      x: [-187, -173, null, -180, -180], y: [0, 0, null, -1.5, 1.5], label: "−180°, 0 dB", ...CRITICAL,
    };
    const y = { label: "|L| [dB]", range: [-40, 40], steps: [5, 10, 20] };
    const inSight = plane.flatMap(({ x, y: gain }) => x.filter((_, i) => Math.abs(gain[i]) <= y.range[1]));
    const [low, high] = extent([...inSight, -225, -90]);
    return {
      curves: [...plane, required, one],
      x: { label: "arg L [°]", range: [45 * Math.floor(low / 45), 45 * Math.ceil(high / 45)], steps: [15, 45, 90, 180] },
      y,
      columns: ["phase_deg", "gain_db"],
      read: (/** @type {number} */ x, /** @type {number} */ y) => `${reading(y, "dB")}, ${reading(x, "°")}`,
    };
  },
};

// Looks of what a curve is held against.
const REQUIRED = { colour: "c-limit", dash: [6, 4], width: 1.2 };
const CRITICAL = { colour: "text", width: 1.4 };
