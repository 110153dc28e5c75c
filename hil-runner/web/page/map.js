// A map of one figure over two keys: each cell is a run, made when nothing else asks the simulator.

import { element, MISSING, reading } from "../../assets/chart.js";
import { isNumber, rangeOf, shareOf, valueAtShare } from "./keys.js";
import { MAP } from "./simulator.js";

/** @import { Form, Key, Range } from "./keys.js" */
/** @import { Answer } from "./simulator.js" */

const [ACROSS, UP] = [31, 21];
/** Viridis at equal steps. */
const COLOURS = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];

/** @param {number} share */
function colourAt(share) {
  const at = share * (COLOURS.length - 1);
  const i = Math.min(COLOURS.length - 2, Math.floor(at));
  const mixed = COLOURS[i].map((part, k) => Math.round(part + (COLOURS[i + 1][k] - part) * (at - i)));
  return `rgb(${mixed})`;
}

/** @typedef {{ key: Key, range: Range, values: number[] }} Axis */

export class GainsMap {
  /**
   * @param {HTMLElement} root @param {Form} form
   * @param {{ sets: () => string[], run: (sets: string[], lane: number) => Promise<Answer | null>, stop: () => void,
   *   pick: (values: [string, string][]) => void }} page its sets, a run, an end to runs that wait, and how to set keys
   */
  constructor(root, form, page) {
    this.form = form;
    this.page = page;
    this.round = 0;
    /** @type {number | undefined} */
    this.frame = undefined;
    /** @type {Axis[] | undefined} */
    this.axes = undefined;
    /** @type {(Answer["figures"][number] | null | undefined)[]} value of each cell, null where there is none */
    this.cells = [];
    const select = (/** @type {string} */ label) => {
      const made = element("select");
      return /** @type {[HTMLElement, HTMLSelectElement]} */ ([element("label", {}, `${label} `, made), made]);
    };
    const [across, x] = select("Across");
    const [up, y] = select("Up");
    const [shown, figure] = select("Figure");
    this.selects = { x, y, figure };
    this.button = element("button", { type: "button", textContent: "Compute map" });
    this.button.addEventListener("click", () => (this.running ? this.stop() : this.start()));
    this.progress = element("progress", { max: ACROSS * UP, value: 0 });
    this.progress.setAttribute("aria-label", "cells of the map");
    this.canvas = element("canvas", { className: "map", tabIndex: 0, width: ACROSS, height: UP });
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-keyshortcuts", "ArrowLeft ArrowRight ArrowUp ArrowDown Enter");
    this.mark = element("i", { className: "map-mark", hidden: true });
    this.here = element("i", { className: "map-here" });
    this.scale = element("p", { className: "hint map-scale" });
    this.told = element("p", { className: "hint" });
    this.told.setAttribute("aria-live", "polite");
    this.yLabel = element("p", { className: "hint map-y" });
    this.xLabel = element("p", { className: "hint map-x" });
    this.area = element(
      "div", { className: "map-area", hidden: true }, this.yLabel,
      element("div", { className: "map-box" }, this.canvas, this.mark, this.here), this.xLabel, this.scale,
    );
    root.append(
      element("div", { className: "bar-line" }, across, up, shown, this.button, this.progress), this.area, this.told,
    );
    for (const choice of [x, y, figure]) choice.addEventListener("change", () => this.choose());
    this.canvas.addEventListener("pointermove", (/** @type {PointerEvent} */ event) => this.point(this.under(event)));
    this.canvas.addEventListener("click", (/** @type {PointerEvent} */ event) => this.pick(this.under(event)));
    this.canvas.addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => this.press(event));
  }

  get running() {
    return this.button.textContent === "Stop";
  }

  /** The keys and figures that there are; what was chosen stays. @param {Answer} live */
  offer(live) {
    const keys = [...this.form.keys.values()].filter((key) => isNumber(key) && this.form.text(key) != null && this.form.number(key) != null);
    const fill = (/** @type {HTMLSelectElement} */ select, /** @type {[string, string][]} */ options, /** @type {string[]} */ first) => {
      const text = JSON.stringify(options);
      if (select.dataset.text === text) return;
      const before = select.value;
      select.dataset.text = text;
      select.replaceChildren(...options.map(([value, textContent]) => element("option", { value, textContent })));
      select.value = [before, ...first].find((value) => options.some(([option]) => option === value)) ?? options[0]?.[0] ?? "";
    };
    const names = keys.map(({ path }) => /** @type {[string, string]} */ ([path, path]));
    fill(this.selects.x, names, ["controller.kp", "controller.kv_per_s", "controller.kp_v_per_rad"]);
    fill(this.selects.y, names, ["controller.kd_s", "controller.velocity_gain_vs_per_rad", "controller.kd_vs_per_rad", "carriage.mass_kg"]);
    const figures = live.figures.filter((/** @type {any} */ { value }) => value != null);
    fill(this.selects.figure, figures.map((/** @type {any} */ { key, label, unit }) => [key, unit ? `${label} [${unit}]` : label]), ["peak_abs_acc_mps2"]);
  }

  /** Another choice of keys is another map; another figure, if the runs are there, the same. */
  choose() {
    const { x, y } = this.selects;
    if (this.axes?.[0].key.path !== x.value || this.axes?.[1].key.path !== y.value) this.stop();
    else if (this.cells.length) this.paint();
  }

  /** @param {string} path @param {number} count @returns {Axis} */
  axis(path, count) {
    const key = /** @type {Key} */ (this.form.keys.get(path));
    const range = rangeOf(key, this.form.number(key) ?? 1);
    const values = Array.from({ length: count }, (_, i) => valueAtShare(key, range, i / (count - 1) || 1e-9));
    return { key, range, values };
  }

  async start() {
    const { x, y } = this.selects;
    if (x.value === y.value) return void (this.told.textContent = "Two different keys make a map.");
    const round = ++this.round;
    const axes = (this.axes = [this.axis(x.value, ACROSS), this.axis(y.value, UP)]);
    const sets = this.page.sets();
    this.others = this.withoutAxes(sets);
    this.cells = new Array(ACROSS * UP);
    this.button.textContent = "Stop";
    this.area.hidden = false;
    this.area.classList.remove("stale");
    this.told.textContent = "";
    const words = (/** @type {Axis} */ { key }) => `${key.meaning.replace(/,$/, "")} ${key.path}${key.unit && ` [${key.unit}]`}`;
    const ends = (/** @type {Axis} */ { values }) => `${values[0]} … ${values[values.length - 1]}`;
    this.xLabel.textContent = `→ ${words(axes[0])}: ${ends(axes[0])}`;
    this.yLabel.textContent = `↑ ${words(axes[1])}: ${ends(axes[1])}`;
    this.paint();
    // Coarse first: every fourth cell, then those between.
    const order = [...this.cells.keys()].sort((a, b) => coarse(a) - coarse(b));
    let done = 0;
    for (const i of order) {
      const more = axes.map(({ key, values }, k) => `${key.path}=${values[k ? UP - 1 - Math.floor(i / ACROSS) : i % ACROSS]}`);
      const run = await this.page.run([...sets, ...more], MAP);
      if (round !== this.round || !run) return;
      this.cells[i] = run.errors ? null : run.figures;
      this.progress.value = ++done;
      this.soon();
    }
    this.button.textContent = "Compute map";
    this.told.textContent = "The map is complete. A click on a cell, or Enter, sets both keys.";
  }

  /** @param {string[]} sets */
  withoutAxes(sets) {
    const paths = this.axes?.map(({ key }) => `${key.path}=`) ?? [];
    return sets.filter((set) => !paths.some((path) => set.startsWith(path))).join("\n");
  }

  /** Follows the page's values: the cell that they are, or that the map is of others. */
  moved() {
    if (!this.axes) return;
    const stale = this.withoutAxes(this.page.sets()) !== this.others;
    if (stale) this.stop();
    if (stale && !this.area.classList.contains("stale")) this.told.textContent = "The map is of other values than the page now: compute it anew.";
    this.area.classList.toggle("stale", stale);
    this.place();
  }

  /** Another file has other keys. */
  clear() {
    this.stop();
    this.axes = undefined;
    this.cells = [];
    this.area.hidden = true;
    this.told.textContent = "";
  }

  stop() {
    if (!this.running) return;
    this.round++;
    this.page.stop();
    this.button.textContent = "Compute map";
    this.told.textContent = `Stopped after ${this.progress.value} of ${ACROSS * UP} cells.`;
  }

  /** Paints at most once a frame. */
  soon() {
    this.frame ??= requestAnimationFrame(() => {
      this.frame = undefined;
      this.paint();
    });
  }

  /** @param {number} i @returns {any} the figure of a cell */
  figure(i) {
    return this.cells[i]?.find((/** @type {any} */ { key }) => key === this.selects.figure.value);
  }

  paint() {
    const values = Array.from({ length: ACROSS * UP }, (_, i) => this.figure(i)?.value);
    const finite = values.filter((value) => value != null);
    const [low, high] = [Math.min(...finite), Math.max(...finite)];
    // What is far apart, all above zero, has colours by its logarithm.
    const log = low > 0 && high / low > 4;
    const share = (/** @type {number} */ v) => (high > low ? (log ? Math.log(v / low) / Math.log(high / low) : (v - low) / (high - low)) : 0.5);
    const pen = this.canvas.getContext("2d");
    if (!pen) return;
    pen.clearRect(0, 0, ACROSS, UP);
    values.forEach((value, i) => {
      if (value == null) return;
      pen.fillStyle = colourAt(share(value));
      pen.fillRect(i % ACROSS, Math.floor(i / ACROSS), 1, 1);
    });
    const figure = this.selects.figure.selectedOptions[0]?.textContent ?? "";
    this.canvas.setAttribute("aria-label", `map of ${figure}; ${this.xLabel.textContent}; ${this.yLabel.textContent}`);
    this.scale.textContent = finite.length ? `${figure}: dark ${reading(low)} … bright ${reading(high)}${log ? ", logarithmic" : ""}; empty cells have no run or no such figure` : "";
    this.place();
  }

  /** A frame around the cell of the page's own values. */
  place() {
    if (!this.axes) return;
    const [x, y] = this.axes.map(({ key, range }) => shareOf(range, this.form.number(key) ?? 0));
    this.here.style.cssText = `left:${100 * x}%;top:${100 * (1 - y)}%`;
  }

  /** @param {PointerEvent} event */
  under(event) {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    const x = Math.min(ACROSS - 1, Math.max(0, Math.floor(((event.clientX - left) / width) * ACROSS)));
    const y = Math.min(UP - 1, Math.max(0, Math.floor(((event.clientY - top) / height) * UP)));
    return y * ACROSS + x;
  }

  /** @param {number} i @returns {[string, string][]} */
  values(i) {
    const [x, y] = this.axes ?? [];
    return x && y ? [[x.key.path, String(x.values[i % ACROSS])], [y.key.path, String(y.values[UP - 1 - Math.floor(i / ACROSS)])]] : [];
  }

  /** @param {number} i */
  point(i) {
    this.at = i;
    const figure = this.figure(i);
    const shown = figure ? `${figure.shown} ${figure.unit}` : this.cells[i] === null ? "the simulator refuses this run" : MISSING;
    this.told.textContent = `${this.values(i).map((pair) => pair.join(" = ")).join(", ")}: ${shown}`;
    this.mark.hidden = false;
    this.mark.style.cssText = `left:${(100 * (i % ACROSS)) / ACROSS}%;top:${(100 * Math.floor(i / ACROSS)) / UP}%`;
  }

  /** @param {number} i */
  pick(i) {
    this.page.pick(this.values(i));
    this.point(i);
    this.place();
  }

  /** @param {KeyboardEvent} event */
  press(event) {
    const at = this.at ?? 0;
    const [x, y] = [at % ACROSS, Math.floor(at / ACROSS)];
    const moves = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const move = moves[/** @type {keyof typeof moves} */ (event.key)];
    if (event.key === "Enter") this.pick(at);
    else if (move) this.point(Math.min(UP - 1, Math.max(0, y + move[1])) * ACROSS + Math.min(ACROSS - 1, Math.max(0, x + move[0])));
    else return;
    event.preventDefault();
  }
}

/** The place of a cell in an order that goes from coarse to fine. @param {number} i */
function coarse(i) {
  const [x, y] = [i % ACROSS, Math.floor(i / ACROSS)];
  return x % 4 || y % 4 ? (x % 2 || y % 2 ? 2 : 1) : 0;
}
