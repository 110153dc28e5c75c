// The pictures of the runs: over time, and the loop's. Only those in view are drawn.

import { drawChart, element, extent, FREQUENCY, reading, TIME } from "../../assets/chart.js";
import { followKeys, followPointer, showCursors } from "../../assets/cursors.js";
import { aligned } from "../../assets/curves.js";
import { loopPlots, loopsOf } from "../../assets/loops.js";
import { drawPlane, joinPlanes } from "../../assets/plane.js";
import { casePlots, curveOf, looks, overPlot, TRACE_OF } from "../../assets/plots.js";
import { saveMenu } from "../../assets/save.js";
import { views } from "../../assets/views.js";

/** @import { Answer } from "./simulator.js" */

/**
 * What is to be seen: the run, one to compare it with, or the rungs instead.
 * @typedef {{ live: Answer, pinned: Answer | null, rungs: Answer[] | null, oneCommand: boolean }} Runs
 * @typedef {{ name: string, figure: HTMLElement, box: HTMLElement, title: string, plane: boolean, view: any, shape: string,
 *   stale: boolean, inView: boolean }} Picture
 */

/** Name, caption, words for a screen reader; the column that stands for it on the ladder. */
const OVER_TIME = [
  ["acceleration", "Acceleration", "acceleration command and carriage acceleration [m/s²]", "acc_mps2"],
  ["following_error", "Following error of the carriage", "following error [mm]", "following_error_mm"],
  ["velocity", "Velocity", "velocity command and carriage velocity [m/s]", "v_mps"],
  ["gap", "Joint gap ε = β − γ", "joint gap [°], with the band of half backlash b and the times of contact", "gap_deg"],
  ["code", "DAC code", "DAC code", "dac_code"],
  ["voltage", "Motor voltage", "motor voltage [V] with the amplifier's limits", "motor_voltage_v"],
  ["current", "Armature current", "armature current [A]", "current_a"],
  ["position", "Position", "position command and carriage position [m]", "x_m"],
];
const OF_LOOP = [
  ["bode_gain", "Bode: gain", "gain of the loop [dB] over frequency [Hz]"],
  ["nyquist", "Nyquist", "Nyquist plot with the circle |1 + L| = 0.5 around −1"],
  ["bode_phase", "Bode: phase", "phase of the loop [°] over frequency [Hz]"],
  ["nichols", "Nichols", "Nichols plot [dB over °] with the contour M_s = 2"],
  ["stiffness", "Stiffness against a force on the carriage", "dynamic stiffness [N/µm] over frequency [Hz]"],
];
const MARGIN = /^(modulus_margin|gain_margin|phase_margin|crossover|bandwidth|least_stiffness)_/;
const PLANES = ["nyquist", "nichols"];

/** The columns of an answer as the report's plots take them. @param {Answer} answer */
export function tracesOf({ columns, traces, data }) {
  const arrays = Object.entries(columns ?? {}).map(([name, [start, length]]) => [name, data.subarray(start, start + length)]);
  return { ...traces, ...Object.fromEntries(arrays) };
}

/** What decides whether a chart can take new data. @param {any} plot */
const shapeOf = ({ curves, yLog }) =>
  JSON.stringify([yLog, curves.map((/** @type {any} */ c) => [c.label, c.colour, c.dash, c.held, c.width])]);

/** One group of pictures, which share zoom and cursor. */
export class Pictures {
  /**
   * @param {HTMLElement} root @param {boolean} loops those of the loop @param {string} group
   * @param {() => void} wanted called when one of them comes into view
   */
  constructor(root, loops, group, wanted) {
    this.group = group;
    this.loops = loops;
    /** @type {Runs | null} */
    this.runs = null;
    /** @type {{ min: number, max: number } | null} */
    this.zoom = null;
    this.reset = element("button", { type: "button", className: "reset", textContent: "Reset zoom", hidden: true });
    this.reset.addEventListener("click", () => this.whole());
    this.notes = element("ul", { className: "hint notes" });
    this.place = element("div", { className: loops ? "plots loops" : "plots" });
    root.append(this.reset, this.notes, this.place);
    /** @type {Picture[]} */
    this.pictures = (loops ? OF_LOOP : OVER_TIME).map(([name, caption, words]) => {
      const box = element("div", { className: "plot" });
      box.setAttribute("role", "img");
      box.setAttribute("aria-label", words);
      const figure = element("figure", {}, element("figcaption", {}, caption, " ", element("span", { className: "key" })), box);
      figure.dataset.plot = name;
      const plane = PLANES.includes(name);
      if (plane) figure.dataset.plane = "";
      this.place.append(figure);
      return { name, figure, box, title: caption, plane, view: null, shape: "", stale: true, inView: false };
    });
    const observer = new IntersectionObserver((entries) => {
      for (const { target, isIntersecting } of entries) {
        const picture = this.pictures.find(({ figure }) => figure === target);
        if (picture) picture.inView = isIntersecting;
        else this.inView = isIntersecting;
      }
      if (this.inView) wanted();
      this.draw();
    });
    this.inView = false;
    observer.observe(root);
    for (const { figure } of this.pictures) observer.observe(figure);
  }

  /** @param {Runs} runs */
  show(runs) {
    this.runs = runs;
    for (const picture of this.pictures) picture.stale = true;
    this.draw();
  }

  /** Draws what is in view, or for paper everything. @param {boolean} all */
  draw(all = false) {
    if (!this.runs?.live.columns) return;
    if (this.loops && (all || this.inView)) this.words(this.runs.live);
    for (const picture of this.pictures) {
      // The planes are joined to the first plot over frequency.
      const needed = all || picture.inView || (this.loops && this.inView && picture === this.pictures[0]);
      if (!picture.stale || !needed) continue;
      picture.stale = false;
      this.picture(picture, this.runs);
    }
  }

  /** What is said above the loop's pictures: its margins, and what it leaves out. @param {Answer} live */
  words({ figures, loops, law }) {
    const margins = figures.filter((/** @type {any} */ { key, value }) => value != null && MARGIN.test(key));
    const told = margins.map((/** @type {any} */ { label, shown, unit }) => `${label} ${shown} ${unit}`.trim());
    const notes = loops ? [told.join(" · "), ...loops.notes] : [`There is no sampled loop${law === "continuous" ? " on rung continuous" : ""}.`];
    const text = JSON.stringify(notes);
    if (this.notes.dataset.text === text) return;
    this.notes.dataset.text = text;
    this.notes.replaceChildren(...notes.map((textContent) => element("li", { textContent })));
    this.place.hidden = !loops && !this.runs?.rungs;
  }

  /** @param {string} name @param {Runs} runs */
  plan(name, { live, pinned, rungs, oneCommand }) {
    if (this.loops) {
      const shown = rungs?.filter(({ loops }) => loops) ?? [...(pinned ? [{ ...pinned, name: "pinned" }] : []), { ...live, name: "live" }];
      const loops = loopsOf(shown.map((run) => ({ name: rungs ? run.law : run.name, loop_curves: run.loops })));
      return loops.length ? { over: FREQUENCY, ...loopPlots[name](loops) } : null;
    }
    const needed = TRACE_OF[name] ?? "t_s";
    const plan = (/** @type {Answer} */ run) => (run.columns[needed] ? casePlots[name](tracesOf(run)) : null);
    if (!rungs) return pinned ? overPlot(plan(pinned), plan(live), ["pinned", "live"], oneCommand) : plan(live);
    const column = OVER_TIME.find((row) => row[0] === name)?.[3] ?? "";
    const curves = rungs.flatMap((run, i) =>
      run.columns[column] ? [curveOf(tracesOf(run), column, { label: run.law, of: run.law, ...looks.ladder(i) })] : [],
    );
    const base = plan(live) ?? plan(rungs[rungs.length - 1]);
    return curves.length ? { ...base, key: undefined, curves } : null;
  }

  /** @param {Picture} picture @param {Runs} runs */
  picture(picture, runs) {
    const plan = this.plan(picture.name, runs);
    const note = plan?.curves.length ? "" : (plan?.missing ?? "There is no such curve.");
    picture.figure.classList.toggle("without", note !== "");
    const key = /** @type {HTMLElement} */ (picture.figure.querySelector(".key"));
    key.textContent = note || plan.key || (plan.marks?.length ? "ticks below: impacts" : "");
    if (note) return;
    if (picture.plane) return this.plane(picture, plan);
    const plot = { over: TIME, include: undefined, limits: undefined, marks: undefined, behind: undefined, ...plan, ...aligned(plan.curves) };
    const shape = shapeOf(plot);
    const { view } = picture;
    if (view && picture.shape === shape) {
      Object.assign(view.plot, plot);
      const data = [plot.x, ...plot.curves.map((/** @type {any} */ curve) => curve.y)];
      view.chart.setData(data, !this.zoom);
      if (this.zoom) view.chart.setScale("x", this.zoom);
    } else this.build(picture, plot);
    picture.shape = shape;
  }

  /** A chart in place of the one before. @param {Picture} picture @param {any} plot */
  build(picture, plot) {
    const { figure, box, title } = picture;
    const before = picture.view;
    const cursorHooks = before?.chart.hooks.setCursor;
    before?.chart.destroy();
    figure.querySelector(".u-legend")?.remove();
    const chart = drawChart(figure, plot, this.group);
    const view = (picture.view ??= { figure, box, title });
    Object.assign(view, { chart, plot });
    if (!before) {
      views.push(view);
      followKeys(view);
      figure.querySelector("figcaption")?.append(saveMenu(view));
    }
    followPointer(view);
    if (this.zoom) chart.setScale("x", this.zoom);
    chart.hooks.setScale = [(/** @type {any} */ u, /** @type {string} */ scale) => scale === "x" && this.zoomed(u)];
    chart.hooks.draw.push(() => showCursors(view));
    // Planes that have been joined to it.
    if (cursorHooks) chart.hooks.setCursor = cursorHooks;
  }

  /** @param {Picture} picture @param {any} plan */
  plane(picture, plan) {
    const { figure, box, title } = picture;
    const shape = shapeOf(plan);
    if (picture.view && picture.shape === shape) {
      Object.assign(picture.view.plot, plan);
      picture.view.chart.setSize({ width: box.clientWidth, height: box.clientHeight });
      return;
    }
    const before = picture.view;
    figure.querySelector(".u-legend")?.remove();
    const view = drawPlane(figure, plan, title);
    picture.shape = shape;
    if (before) return void Object.assign(before, view);
    picture.view = view;
    views.push(view);
    figure.querySelector("figcaption")?.append(saveMenu(view));
    const gain = this.pictures[0].view;
    if (gain) joinPlanes([gain], [view]);
  }

  /** @param {any} u */
  zoomed(u) {
    const [times] = u.data;
    const { min, max } = u.scales.x;
    const part = min > times[0] || max < times[times.length - 1];
    // A shorter run may end before the zoom begins.
    this.zoom = part && min < times[times.length - 1] ? { min, max } : null;
    this.reset.hidden = !this.zoom;
  }

  /** All that the runs have. */
  whole() {
    this.zoom = null;
    for (const { view, plane } of this.pictures) {
      if (!view || plane) continue;
      const [times] = view.chart.data;
      view.chart.setScale("x", { min: times[0], max: times[times.length - 1] });
    }
  }

  /** What a screen reader hears of a picture, told at rest. */
  name() {
    for (const { box, view, plane, name } of this.pictures) {
      if (!view || plane) continue;
      const [low, high] = extent(...view.chart.data.slice(1));
      const words = (this.loops ? OF_LOOP : OVER_TIME).find((row) => row[0] === name)?.[2];
      box.setAttribute("aria-label", `${words}; from ${reading(low)} to ${reading(high)}`);
    }
  }
}
