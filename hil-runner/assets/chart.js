// One plot: axes, curves, reference lines and shading on top of uPlot.
// Colours are CSS variables, looked up when drawn: a redraw after `newColours` is all that
// a change of the colour scheme needs.

/**
 * A column of numbers, an array or a Float64Array; null is a hole.
 * @typedef {any[]} Column
 * Kind of a plot's horizontal axis, see `over`.
 * @typedef {{ name?: string, label: string, column: string, at: (x: number) => string, log: boolean,
 *   cursors: Record<string, number | null> }} Over
 * A curve with its look; `t` are times of its own, `f` the frequencies along a curve of a plane.
 * @typedef {{ label: string, y: Column, t?: Column, x?: Column, f?: Column, unit?: string, column?: string, of?: string,
 *   colour: string, width?: number, dash?: number[], held?: boolean }} Curve
 * A line across a plot with its name.
 * @typedef {{ value: number, label: string, below?: boolean, colour?: string }} Limit
 * A range with steps for its ticks.
 * @typedef {{ label: string, range: [number, number], steps: number[] }} PlaneAxis
 * A plot over time or frequency; a plane has `PlaneAxis` in `x` and `y`.
 * @typedef {{ over: Over, x?: any, y?: any, curves: Curve[], yLabel: string, yLog?: boolean, ySteps?: number[],
 *   include?: (number | null)[], limits?: Limit[], marks?: number[], behind?: (u: any) => void, key?: string, missing?: string,
 *   square?: boolean, columns?: string[], read?: (x: number, y: number) => string, pointer?: number | null }} Plot
 * A plot on the page; `chart` is uPlot's, or what a plane has in its place.
 * @typedef {{ figure: HTMLElement, box: HTMLElement, chart: any, plot: Plot, title: string, point?: (f: number | null) => void }} View
 */

export const MISSING = "–";
/** @param {string} text */
export const minus = (text) => text.replace("-", "−");
/** @type {Record<string, string>} */
let colours = {};
export const newColours = () => (colours = {});
/** @param {string} name @returns {string} */
export const cssColour = (name) =>
  (colours[name] ??= getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim());
const tickFont = '12px system-ui, -apple-system, "Segoe UI", Roboto, Arial, sans-serif';

/**
 * @template {keyof HTMLElementTagNameMap} Tag
 * @param {Tag} tag @param {object} properties @param {(Node | string)[]} children
 */
export function element(tag, properties = {}, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

// An element that is there.
/** @param {ParentNode} root @param {string} selector */
export const within = (root, selector) => /** @type {HTMLElement} */ (root.querySelector(selector));

// Four significant digits and no more decimals than the unit deserves.
/** @param {number | null | undefined} value @param {string} [unit] */
export function reading(value, unit) {
  if (value == null) return MISSING;
  const size = Math.abs(value);
  const text =
    size === 0 ? "0" : size >= 1e-3 ? String(+value.toPrecision(4)) : value.toExponential(2);
  return minus(text) + (unit ? ` ${unit}` : "");
}

// What a plot is over: the name of its axis and of its column, a place on it in words, and
// the cursors on it, which every plot over the same has.
/** @param {string} label @param {string} column @param {(x: number) => string} at @returns {Over} */
const over = (label, column, at, log = false) => ({ label, column, at, log, cursors: { A: null, B: null } });
export const TIME = over("t [s]", "t_s", (t) => `${+t.toFixed(6)} s`);
export const FREQUENCY = over("f [Hz]", "f_hz", (f) => reading(f, "Hz"), true);

// Ticks of a logarithmic axis; those without room are null.
/** @param {any} u @param {(number | null)[]} splits */
export function logTicks(u, splits) {
  const plain = (/** @type {number} */ v) => v >= 1e-3 && v < 1e6;
  return splits.map((v) => (v == null ? null : plain(v) ? String(+v.toPrecision(6)) : minus(v.toExponential(0))));
}

// Ticks with as many decimals as the step between them has, not the
// browser's language: two readers of one report see the same numbers.
/** @param {any} u @param {(number | null)[]} splits @param {any} axis @param {number} space @param {number} step */
export function ticks(u, splits, axis, space, step) {
  const decimals = Math.max(0, Math.ceil(-Math.log10(step) - 1e-9));
  if (decimals > 5) return splits.map((v) => (v == null ? null : v === 0 ? "0" : minus(v.toExponential(1))));
  const digits = (/** @type {number} */ v) => {
    for (let d = decimals; d < decimals + 3; d++) {
      if (Math.abs(step - +step.toFixed(d)) < step * 1e-6) return v.toFixed(d);
    }
    return v.toFixed(decimals);
  };
  return splits.map((v) => (v == null ? null : minus(digits(Math.abs(v) < step / 1e6 ? 0 : v))));
}

/** @param {string} label @param {number} size @param {number} space @param {boolean} [log] @param {number[]} [incrs] */
function axis(label, size, space, log, incrs) {
  return {
    ...(incrs ? { incrs } : {}),
    label,
    space,
    labelSize: 18,
    labelGap: 0,
    labelFont: tickFont,
    font: tickFont,
    size,
    gap: 3,
    stroke: () => cssColour("muted"),
    grid: { stroke: () => cssColour("grid"), width: 1 },
    ticks: { stroke: () => cssColour("rule"), width: 1, size: 4 },
    values: log ? logTicks : ticks,
  };
}

// Smallest and largest of several columns, holes skipped.
/** @param {Column[]} columns @returns {[number, number]} */
export function extent(...columns) {
  let [low, high] = [Infinity, -Infinity];
  for (const column of columns) {
    for (const v of column) {
      if (v == null) continue;
      if (v < low) low = v;
      if (v > high) high = v;
    }
  }
  return low <= high ? [low, high] : [0, 0];
}

// The range of the vertical axis. `plot.include` belongs to the whole picture
// (limits, the partner plot's range); a reader who zooms in wants the curve.
/** @param {Plot} plot */
function verticalRange(plot) {
  return (/** @type {any} */ u, /** @type {number | null} */ low, /** @type {number | null} */ high) => {
    const [first, last] = u.series[0].idxs ?? [0, u.data[0].length - 1];
    const whole = first === 0 && last === u.data[0].length - 1;
    const values = [low, high, ...((whole && plot.include) || [])].filter((v) => v != null);
    const [least, most] = extent(values);
    if (!(most > least)) {
      const half = Math.abs(least) * 0.1 || 1;
      return values.length ? [least - half, most + half] : [-1, 1];
    }
    const margin = 0.06 * (most - least);
    return [least - margin, most + margin];
  };
}

// A dashed line across the plot with its name at the right end.
/** @param {any} u @param {Limit} limit */
export function drawLimit(u, { value, label, below, colour = "c-limit" }) {
  const { ctx, bbox } = u;
  const y = Math.round(u.valToPos(value, "y", true));
  if (y < bbox.top || y > bbox.top + bbox.height) return;
  const px = devicePixelRatio;
  ctx.strokeStyle = ctx.fillStyle = cssColour(colour);
  ctx.lineWidth = px;
  ctx.setLineDash([6 * px, 4 * px]);
  ctx.beginPath();
  ctx.moveTo(bbox.left, y);
  ctx.lineTo(bbox.left + bbox.width, y);
  ctx.stroke();
  ctx.setLineDash([]);
  ctx.font = tickFont.replace("12px", `${11 * px}px`);
  ctx.textAlign = "right";
  ctx.textBaseline = below ? "top" : "bottom";
  ctx.fillText(label, bbox.left + bbox.width - 4 * px, y + (below ? 3 : -2) * px);
}

// Shades a rectangle given in data; null reaches to the plot's edge.
/** @param {any} u @param {string} colour @param {(number | null)[]} x @param {(number | null)[]} y */
export function shade(u, colour, [x0, x1], [y0, y1]) {
  const { ctx, bbox } = u;
  const clampX = (/** @type {number} */ x) => Math.min(Math.max(x, bbox.left), bbox.left + bbox.width);
  const clampY = (/** @type {number} */ y) => Math.min(Math.max(y, bbox.top), bbox.top + bbox.height);
  const left = x0 == null ? bbox.left : clampX(u.valToPos(x0, "x", true));
  const right = x1 == null ? bbox.left + bbox.width : clampX(u.valToPos(x1, "x", true));
  const top = y1 == null ? bbox.top : clampY(u.valToPos(y1, "y", true));
  const bottom = y0 == null ? bbox.top + bbox.height : clampY(u.valToPos(y0, "y", true));
  ctx.fillStyle = cssColour(colour);
  ctx.fillRect(left, top, right - left, bottom - top);
}

// uPlot remembers what it last set on the canvas and would not notice ours.
/** @param {(u: any) => void} paint */
function apart(paint) {
  return (/** @type {any} */ u) => {
    u.ctx.save();
    paint(u);
    u.ctx.restore();
  };
}

// The zero line, a little stronger than the grid.
/** @param {any} u */
export function drawZero(u) {
  const { ctx, bbox } = u;
  const y = u.valToPos(0, "y", true);
  // A logarithmic axis has none.
  if (!(y >= bbox.top && y <= bbox.top + bbox.height)) return;
  ctx.fillStyle = cssColour("rule");
  ctx.fillRect(bbox.left, Math.round(y), bbox.width, Math.max(1, Math.round(devicePixelRatio)));
}

// Short marks on the lower edge.
/** @param {any} u @param {number[]} times */
export function drawMarks(u, times) {
  const { ctx, bbox } = u;
  const [px, bottom] = [devicePixelRatio, bbox.top + bbox.height];
  ctx.fillStyle = cssColour("text");
  for (const t of times) {
    const x = Math.round(u.valToPos(t, "x", true));
    if (x < bbox.left || x > bbox.left + bbox.width) continue;
    ctx.fillRect(x, bottom - 7 * px, Math.max(1, Math.round(px)), 7 * px);
  }
}

// x and y of a curve: those of a plane have an x of their own.
/** @param {any} u @param {number} series @returns {[Column, Column]} */
export const columns = (u, series) => (u.data[0] ? [u.data[0], u.data[series]] : u.data[series]);

// Places on a scale in pixels of the canvas; a linear one is two numbers.
/** @param {any} u @param {string} scale */
function placer(u, scale) {
  const { min, max, distr } = u.scales?.[scale] ?? {};
  const place = (/** @type {number} */ value) => u.valToPos(value, scale, true);
  if (distr !== 1 || !(max > min)) return place;
  const [from, per] = [place(min), (place(max) - place(min)) / (max - min)];
  return (/** @type {number} */ value) => from + (value - min) * per;
}

// Leads `pen` along a curve, at fractions of a pixel: a hole where a value is none, steps
// where a value is held. Points are left out that are no further than `off` pixels from
// the line drawn; with 0 none are.
/**
 * @param {any} u @param {number} series @param {number} first @param {number} last
 * @param {{ moveTo: (x: number, y: number) => void, lineTo: (x: number, y: number) => void }} pen @param {boolean | undefined} held @param {number} off
 */
export function follow(u, series, first, last, pen, held, off = 0) {
  const [xs, ys] = columns(u, series);
  const [placeX, placeY] = [placer(u, "x"), placer(u, "y")];
  // The last point drawn, the one that waits, and slopes from the first that keep to all between.
  let [x0, y0, x1, y1, low, high] = [0, 0, 0, 0, 0, 0];
  let [drawn, waits] = [false, false];
  // One point more on either side, so that a zoomed curve reaches the edge.
  const end = Math.min(xs.length - 1, last + 1);
  for (let i = Math.max(0, first - 1); i <= end; i++) {
    if (!Number.isFinite(ys[i])) {
      if (waits) pen.lineTo(x1, y1);
      drawn = waits = false;
      continue;
    }
    const [x, y] = [placeX(xs[i]), placeY(ys[i])];
    if (!drawn) pen.moveTo(x, y);
    else if (held) {
      [x1, y1, waits] = [x, y0, off > 0 && Math.abs(y - y0) <= off];
      if (waits) continue;
      pen.lineTo(x, y0);
      pen.lineTo(x, y);
    } else if (!off) pen.lineTo(x, y);
    else {
      const slope = (y - y0) / (x - x0);
      if (waits && (x <= x0 || slope < low || slope > high)) {
        pen.lineTo(x1, y1);
        [x0, y0, waits] = [x1, y1, false];
      }
      const [under, over] = [(y - off - y0) / (x - x0), (y + off - y0) / (x - x0)];
      low = waits ? Math.max(low, under) : under;
      high = waits ? Math.min(high, over) : over;
      [x1, y1, waits] = [x, y, true];
      continue;
    }
    [x0, y0, drawn] = [x, y, true];
  }
  if (waits) pen.lineTo(x1, y1);
}

// A tenth of a pixel is not seen.
const UNSEEN = 0.1;

// Path builders for uPlot.
/** @param {boolean} held */
const path = (held) => (/** @type {any} */ u, /** @type {number} */ series, /** @type {number} */ first, /** @type {number} */ last) => {
  const stroke = new Path2D();
  follow(u, series, first, last, stroke, held, UNSEEN);
  return { stroke, fill: null, clip: null, band: null, gaps: null, flags: 1 };
};
const [polyline, stairs] = [path(false), path(true)];

// Names of curves are switches: a click, Enter or Space shows and hides.
/** @param {any} u @param {Element} caption */
function switches(u, caption) {
  const names = [.../** @type {NodeListOf<HTMLElement>} */ (caption.querySelectorAll(".u-series th"))].slice(1);
  names.forEach((name, i) => {
    name.tabIndex = 0;
    name.setAttribute("role", "button");
    name.title = "show or hide";
    name.addEventListener("keydown", (event) => {
      if (event.key !== "Enter" && event.key !== " ") return;
      event.preventDefault();
      name.click();
    });
    const tell = () => name.setAttribute("aria-pressed", u.series[i + 1].show);
    u.hooks.setSeries = [...(u.hooks.setSeries ?? []), tell];
    tell();
  });
}

// The legend is the document's, not the canvas's: CSS colours it.
/** @param {Element} caption @param {Curve[]} curves */
export function colourMarkers(caption, curves) {
  const markers = [.../** @type {NodeListOf<HTMLElement>} */ (caption.querySelectorAll(".u-marker"))];
  markers.slice(-curves.length).forEach((marker, i) => {
    const { colour, dash } = curves[i];
    marker.style.borderTopColor = `var(--${colour})`;
    if (dash) marker.style.borderTopStyle = dash[0] < 4 ? "dotted" : "dashed";
  });
}

// Draws `plot` = { over, x, curves: [{ label, y, unit, column, colour, width, dash, held }],
// yLabel, yLog, ySteps, include, limits, marks, behind } into `figure`.
/** @param {HTMLElement} figure @param {Plot} plot @param {string | undefined} group */
export function drawChart(figure, plot, group) {
  const box = within(figure, ".plot");
  const caption = within(figure, "figcaption");
  /** @type {any} */
  const options = {
    width: box.clientWidth,
    height: box.clientHeight,
    padding: [6, 14, 0, 0],
    cursor: {
      y: false,
      points: { size: 6 },
      drag: { x: true, y: false, setScale: true },
      sync: { key: group, scales: ["x", null], setSeries: false },
    },
    legend: {
      show: true,
      live: true,
      mount: (/** @type {any} */ u, /** @type {Element} */ element) => caption.appendChild(element),
      markers: { show: true, width: 0 },
    },
    scales: {
      x: plot.over.log ? { time: false, distr: 3, range: (/** @type {any} */ u, /** @type {number} */ low, /** @type {number} */ high) => [low, high] } : { time: false },
      y: plot.yLog
        ? { distr: 3, range: (/** @type {any} */ u, /** @type {number} */ low, /** @type {number} */ high) => uPlot.rangeLog(low, high, 10, true) }
        : { range: verticalRange(plot) },
    },
    axes: [axis(plot.over.label, 22, 50, plot.over.log), axis(plot.yLabel, 46, 20, plot.yLog, plot.ySteps)],
    series: [
      { label: plot.over.label[0], value: (/** @type {any} */ u, /** @type {number | null} */ x) => (x == null ? MISSING : plot.over.at(x)) },
      ...plot.curves.map((curve) => ({
        label: curve.label,
        value: (/** @type {any} */ u, /** @type {number | null} */ v) => reading(v, curve.unit),
        stroke: () => cssColour(curve.colour),
        width: curve.width ?? 1.4,
        dash: curve.dash,
        points: { show: false },
        paths: curve.held ? stairs : polyline,
        pxAlign: 0,
      })),
    ],
    hooks: {
      setLegend: [(/** @type {any} */ u) => caption.classList.toggle("reading", u.cursor.idx != null)],
      drawClear: [apart((u) => plot.behind?.(u))],
      drawAxes: [apart(drawZero)],
      draw: [
        apart((u) => {
          for (const limit of plot.limits ?? []) drawLimit(u, limit);
          if (plot.marks) drawMarks(u, plot.marks);
        }),
      ],
    },
  };
  const chart = new uPlot(options, [plot.x, ...plot.curves.map((curve) => curve.y)], box);
  caption.classList.toggle("alone", plot.curves.length === 1);
  colourMarkers(caption, plot.curves);
  if (plot.curves.length > 1) switches(chart, caption);
  return chart;
}
