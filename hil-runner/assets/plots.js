// The plots of a run: which curves each shows, on which axis, against what.

import { extent, minus, shade } from "./chart.js";

/** @import { Curve, Plot } from "./chart.js" */
/** @typedef {Omit<Plot, "over">} Plan a plot before it is known what it is over */

const ACCELERATION = "acceleration [m/s²]";

// Columns of a run, in the order of the choice of quantities: words and unit.
/** @type {Record<string, [string, string]>} */
export const QUANTITIES = {
  acc_mps2: ["carriage acceleration", "m/s²"],
  acc_ref_mps2: ["acceleration command", "m/s²"],
  x_m: ["carriage position", "m"],
  x_ref_m: ["position command", "m"],
  v_mps: ["carriage velocity", "m/s"],
  v_ref_mps: ["velocity command", "m/s"],
  following_error_mm: ["following error x_ref − x", "mm"],
  current_a: ["armature current", "A"],
  motor_voltage_v: ["motor voltage", "V"],
  dac_code: ["DAC code", ""],
  gap_deg: ["joint gap ε", "°"],
};

// A column of a run as a curve.
/** @param {any} traces @param {string} column @param {Partial<Curve>} look @returns {Curve} */
export function curveOf(traces, column, look) {
  const [label, unit] = QUANTITIES[column];
  const held = column === "dac_code" || (column === "motor_voltage_v" && traces.voltage_held);
  return { t: traces.t_s, y: traces[column], column, label, unit, held, colour: "c-plain", ...look };
}
/** @param {any} traces @param {string} column */
const command = (traces, column) =>
  curveOf(traces, column, { label: "command", colour: "c-command", dash: [6, 4] });
/** @param {any} traces @param {string} column */
const carriage = (traces, column) =>
  curveOf(traces, column, { label: "carriage", colour: "c-carriage" });

// Command and carriage of one case: the same vertical scale, else the eye
// compares shapes that are not comparable.
/** @param {any} traces */
const accelerationRange = (traces) => extent(traces.acc_ref_mps2, traces.acc_mps2);

// A limit far outside the picture would flatten the curve; it is named in the
// caption instead. 30 % is where the curve still has a third of the height.
const LIMIT_IN_SIGHT = 0.3;

/** @type {Record<string, (traces: any) => Plan>} */
export const casePlots = {
  command: (traces) => ({
    curves: [{ ...command(traces, "acc_ref_mps2"), colour: "text", dash: undefined }],
    yLabel: ACCELERATION,
    include: accelerationRange(traces),
  }),
  carriage: (traces) => ({
    curves: [carriage(traces, "acc_mps2")],
    yLabel: ACCELERATION,
    include: accelerationRange(traces),
  }),
  acceleration: (traces) => ({
    curves: [command(traces, "acc_ref_mps2"), carriage(traces, "acc_mps2")],
    yLabel: ACCELERATION,
    marks: traces.impacts_s,
  }),
  position: (traces) => ({
    curves: [command(traces, "x_ref_m"), carriage(traces, "x_m")],
    yLabel: "position [m]",
  }),
  velocity: (traces) => ({
    curves: [command(traces, "v_ref_mps"), carriage(traces, "v_mps")],
    yLabel: "velocity [m/s]",
  }),
  following_error: (traces) => ({
    curves: [curveOf(traces, "following_error_mm", { label: "error" })],
    yLabel: "x_ref − x [mm]",
    include: [0],
  }),
  voltage: voltagePlot,
  current: (traces) => ({
    curves: [curveOf(traces, "current_a", { label: "current" })],
    yLabel: "current [A]",
    include: [0],
  }),
  code: codePlot,
  gap: gapPlot,
};

/** @param {any} traces */
function voltagePlot(traces) {
  const limit = traces.voltage_limit_v;
  /** @type {Plan} */
  const plot = {
    curves: [curveOf(traces, "motor_voltage_v", { label: "voltage" })],
    yLabel: "voltage [V]",
    include: [0],
  };
  if (limit === null) return plot;
  plot.include = [-limit, limit];
  plot.limits = [
    { value: limit, label: `+V_max = ${limit} V`, below: true },
    { value: -limit, label: `−V_max = −${limit} V` },
  ];
  return plot;
}

/** @param {any} traces */
function codePlot(traces) {
  /** @type {Plan} */
  const plot = {
    curves: [curveOf(traces, "dac_code", { label: "code" })],
    yLabel: "code",
    include: [0],
  };
  if (!traces.code_limits) return plot;
  const [low, high] = traces.code_limits;
  const [least, most] = extent(traces.dac_code);
  const used = Math.max(most / high, least / low);
  if (used > LIMIT_IN_SIGHT) {
    plot.include = [low, high];
    plot.limits = [
      { value: high, label: minus(`${high}`), below: true },
      { value: low, label: minus(`${low}`) },
    ];
  } else {
    plot.key = minus(`range ${low} … ${high}, at most ${Math.ceil(100 * used)} % used`);
  }
  return plot;
}

// The play as a grey band; contact +1 is shaded above it and −1 below it,
// where the joint then is, so that colour is not the only sign.
/** @param {any} traces */
function gapPlot(traces) {
  const b = traces.backlash_half_deg;
  const curves = [curveOf(traces, "gap_deg", { label: "ε" })];
  /** @type {Plan} */
  const plot = { curves, yLabel: "gap ε [°]", include: [0] };
  if (!(b > 0)) return plot;
  plot.include = [-1.2 * b, 1.2 * b];
  plot.limits = [
    { value: b, label: "+b", colour: "muted" },
    { value: -b, label: "−b", below: true, colour: "muted" },
  ];
  plot.behind = (u) => {
    shade(u, "c-band", [null, null], [-b, b]);
    for (const { start_s, end_s, contact } of traces.contact_intervals) {
      if (contact > 0) shade(u, "c-drive", [start_s, end_s], [b, null]);
      if (contact < 0) shade(u, "c-coast", [start_s, end_s], [null, -b]);
    }
  };
  return plot;
}

const RUN_COLOURS = ["c-rung-3", "c-vermilion", "c-rung-2", "c-rung-4", "c-command"];

// The lowest rung is broad and pale and every next one thinner, so that
// curves that coincide can still be seen to do so. Cases have one width, and
// dashes where the colours begin again.
/** @type {Record<string, (i: number) => Partial<Curve>>} */
export const looks = {
  cases: (i) => ({
    colour: RUN_COLOURS[i % RUN_COLOURS.length],
    dash: [undefined, [8, 3], [4, 4]][Math.floor(i / RUN_COLOURS.length) % 3],
  }),
  ladder: (i) => ({ colour: `c-rung-${Math.min(i, 4)}`, width: Math.max(1, 5 - 1.2 * i) }),
};

// The plot of one run with the curves of one before it; either may be missing.
/**
 * @param {Plan | null} before @param {Plan | null} after @param {[string, string]} words @param {boolean} oneCommand
 * @returns {Plan | null}
 */
export function overPlot(before, after, [first, last], oneCommand) {
  if (!before || !after) return before || after;
  const named = (/** @type {Plan} */ plot, /** @type {string} */ word, /** @type {Partial<Curve>} */ look) =>
    plot.curves
      .filter(({ label }) => label !== "command" || !oneCommand || word === last)
      .map((curve) => {
        const command = curve.label === "command";
        const label = plot.curves.length === 1 ? word : command && oneCommand ? "command" : `${curve.label} ${word}`;
        return { ...curve, of: word, label, ...(command ? { dash: word === first ? [2, 3] : [6, 4] } : look) };
      });
  return {
    ...before,
    ...after,
    key: after.key && `${last}: ${after.key}`,
    include: [...(before.include ?? []), ...(after.include ?? [])],
    curves: [
      ...named(before, first, { colour: "c-rung-4", dash: [6, 4] }),
      ...named(after, last, { colour: "c-carriage", dash: undefined }),
    ],
  };
}

// Columns without which there is no such plot.
/** @type {Record<string, string>} */
export const TRACE_OF = { code: "dac_code", gap: "gap_deg" };
