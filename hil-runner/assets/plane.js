import { colourMarkers, cssColour, element, MISSING, ticks, within } from "./chart.js";
import { setCursor } from "./cursors.js";
import { valueAt } from "./curves.js";
import { svgOf } from "./save.js";

// A picture of a plane: curves that are no functions of x, each with the frequency along it,
// on two linear axes. It is drawn as the SVG that Save gives.

// Multiples of the first step that leaves `space` pixels between two of them.
/** @import { Curve, PlaneAxis, Plot, View } from "./chart.js" */

/** @param {PlaneAxis} axis @param {number} pixels @param {number} space */
function splitsOf({ range: [low, high], steps }, pixels, space) {
  const fits = (/** @type {number} */ step) => (pixels * step) / (high - low) >= space;
  const step = steps.find(fits) ?? steps[steps.length - 1];
  const first = Math.ceil(low / step - 1e-9);
  const count = Math.floor(high / step + 1e-9) - first + 1;
  const splits = Array.from({ length: count }, (_, i) => (first + i) * step);
  return { _splits: splits, _values: ticks(null, splits, null, space, step) };
}

// The same length of a unit on both axes, around the middle of what is to be seen.
/** @param {PlaneAxis} x @param {PlaneAxis} y @param {number} width @param {number} height @returns {[PlaneAxis, PlaneAxis]} */
function squared(x, y, width, height) {
  const span = (/** @type {PlaneAxis} */ { range: [low, high] }) => high - low;
  const unit = Math.min(width / span(x), height / span(y));
  const around = (/** @type {PlaneAxis} */ axis, /** @type {number} */ pixels) => {
    const middle = (axis.range[0] + axis.range[1]) / 2;
    return { ...axis, range: /** @type {[number, number]} */ ([middle - pixels / unit / 2, middle + pixels / unit / 2]) };
  };
  return [around(x, width), around(y, height)];
}

// What a plane has in place of uPlot's chart, in pixels of a canvas: place, scales, curves.
/** @param {Plot} plot @param {number} width @param {number} height @returns {any} */
export function planeOf(plot, width, height) {
  const px = devicePixelRatio;
  const [left, top] = [64, 6];
  const [inner, tall] = [Math.max(1, width - left - 14), Math.max(1, height - top - 40)];
  const [x, y] = plot.square ? squared(plot.x, plot.y, inner, tall) : [plot.x, plot.y];
  const share = (/** @type {number} */ value, /** @type {PlaneAxis} */ { range: [low, high] }) => (value - low) / (high - low);
  return {
    width,
    height,
    bbox: { left: left * px, top: top * px, width: inner * px, height: tall * px },
    data: [null, ...plot.curves.map((curve) => [curve.x, curve.y])],
    axes: [
      { label: x.label, ...splitsOf(x, inner, 44) },
      { label: y.label, ...splitsOf(y, tall, 24) },
    ],
    valToPos: (/** @type {number} */ value, /** @type {string} */ scale) =>
      scale === "x" ? px * (left + inner * share(value, x)) : px * (top + tall * (1 - share(value, y))),
  };
}

// The place on a curve at a frequency; none outside of it.
/** @param {Curve} curve @param {number | null | undefined} frequency @returns {[number, number] | null} */
export function placeAt({ f, x, y }, frequency) {
  if (!f || !x || frequency == null) return null;
  const [across, up] = [valueAt(f, x, frequency), valueAt(f, y, frequency)];
  return across == null || up == null ? null : [across, up];
}

// The frequency of the point of a curve that is nearest to a place in pixels of the canvas, none
// beyond `reach`.
/** @param {View} view @param {number} px @param {number} py @param {number} reach @returns {number | null} */
export function nearest({ chart, plot }, px, py, reach) {
  /** @type {number | null} */
  let found = null;
  let least = reach;
  plot.curves.forEach(({ f, x, y }, i) => {
    if (!f || !x || !chart.series[i + 1].show) return;
    f.forEach((frequency, k) => {
      const distance = Math.hypot(chart.valToPos(x[k], "x") - px, chart.valToPos(y[k], "y") - py);
      if (distance < least) [found, least] = [frequency, distance];
    });
  });
  return found;
}

// Marks on the visible curves: the cursors and the pointer.
/** @param {any} u @param {any} pen @param {Plot} plot @param {any} show */
export function drawPlaces(u, pen, plot, show) {
  const px = devicePixelRatio;
  const { left, top, width, height } = u.bbox;
  /** @type {[string, number | null | undefined][]} */
  const marks = [["A", plot.over.cursors.A], ["B", plot.over.cursors.B], ["", plot.pointer]];
  plot.curves.forEach((curve, i) => {
    for (const [name, frequency] of marks) {
      const place = show[i + 1].show && placeAt(curve, frequency);
      if (!place) continue;
      const [x, y] = [u.valToPos(place[0], "x"), u.valToPos(place[1], "y")];
      if (x < left || x > left + width || y < top || y > top + height) continue;
      Object.assign(pen, { fillStyle: cssColour(name ? "text" : curve.colour), textAlign: "left", textBaseline: "bottom" });
      pen.fillRect(x - 3 * px, y - 3 * px, 6 * px, 6 * px);
      if (name) pen.fillText(name, x + 5 * px, y - 2 * px);
    }
  });
}

let planes = 0;

// Draws `plot` = { curves: [{ label, f, x, y, colour, … }], x, y: { label, range, steps }, square,
// columns, read } into `figure`; gives a view as other plots have it.
/** @param {HTMLElement} figure @param {Plot} plot @param {string} title @returns {View} */
export function drawPlane(figure, plot, title) {
  const box = within(figure, ".plot");
  const caption = within(figure, "figcaption");
  const area = `area-${++planes}`;
  /** @type {{ show?: boolean }[]} */
  const series = [{}, ...plot.curves.map(() => ({ show: true }))];
  /** @type {View} */
  const view = { figure, box, plot, title, chart: null };
  view.chart = {
    redraw: () => (box.innerHTML = svgOf(view, true)),
    setSize(/** @type {{ width: number, height: number }} */ { width, height }) {
      Object.assign(view.chart, planeOf(plot, width, height));
      view.chart.redraw();
    },
    series,
    area,
  };
  const value = () => element("td", { className: "u-value" });
  const frequency = value();
  const values = plot.curves.map(value);
  const rows = plot.curves.map(({ f, label }, i) => {
    const name = element(
      "th", { tabIndex: 0, title: "show or hide" },
      element("div", { className: "u-marker" }), element("div", { className: "u-label", textContent: label }),
    );
    name.setAttribute("role", "button");
    const row = element("tr", { className: "u-series" }, name, ...(f ? [values[i]] : []));
    const turn = () => {
      const show = (series[i + 1].show = !series[i + 1].show);
      row.classList.toggle("u-off", !show);
      name.setAttribute("aria-pressed", String(show));
      view.chart.redraw();
    };
    name.setAttribute("aria-pressed", "true");
    name.addEventListener("click", turn);
    name.addEventListener("keydown", (event) => {
      if (event.key !== "Enter" && event.key !== " ") return;
      event.preventDefault();
      turn();
    });
    return row;
  });
  const head = element("tr", { className: "u-series" }, element("th", { textContent: plot.over.name ?? "f" }), frequency);
  const legend = element("table", { className: "u-legend u-inline u-live" }, element("tbody", {}, head, ...rows));
  caption.append(legend);
  colourMarkers(caption, plot.curves);
  view.point = (/** @type {number | null} */ f) => {
    if (plot.pointer === f) return;
    plot.pointer = f;
    caption.classList.toggle("reading", f != null);
    frequency.textContent = f == null ? MISSING : plot.over.at(f);
    plot.curves.forEach((curve, i) => {
      const place = placeAt(curve, f);
      values[i].textContent = place && plot.read ? plot.read(...place) : MISSING;
    });
    view.chart.redraw();
  };
  view.chart.setSize({ width: box.clientWidth, height: box.clientHeight });
  return view;
}

// The pointer over a plane is that of the plots over frequency, and theirs is its.
/** @param {View[]} charts @param {View[]} planes */
export function joinPlanes(charts, planes) {
  if (!charts.length) return;
  const [first] = charts;
  const point = (/** @type {any} */ u) => {
    const f = u.cursor.idx == null ? null : u.data[0][u.cursor.idx];
    planes.forEach((plane) => plane.point?.(f));
  };
  first.chart.hooks.setCursor = [...(first.chart.hooks.setCursor ?? []), point];
  for (const plane of planes) {
    const at = (/** @type {MouseEvent} */ event) => {
      const { left, top } = plane.box.getBoundingClientRect();
      const px = devicePixelRatio;
      return nearest(plane, (event.clientX - left) * px, (event.clientY - top) * px, 40 * px);
    };
    const show = (/** @type {number | null} */ f) => {
      const { chart } = first;
      chart.setCursor(f == null ? { left: -10, top: -10 } : { left: chart.valToPos(f, "x"), top: 1 });
    };
    plane.box.addEventListener("pointermove", (event) => show(at(event)));
    plane.box.addEventListener("pointerleave", () => show(null));
    plane.box.addEventListener("click", (event) => {
      const f = at(event);
      if (f != null) setCursor(first, event.shiftKey, f);
    });
  }
}
