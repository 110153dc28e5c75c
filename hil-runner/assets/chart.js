"use strict";

// One plot: axes, curves, reference lines and shading on top of uPlot.
// Colours are CSS variables, looked up at every draw, so that a redraw is all
// that a change of the colour scheme needs.

const MISSING = "–";
const minus = (text) => text.replace("-", "−");
const cssColour = (name) =>
  getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
const tickFont = '12px system-ui, -apple-system, "Segoe UI", Roboto, Arial, sans-serif';

function element(tag, properties = {}, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

// Four significant digits and no more decimals than the unit deserves.
function reading(value, unit) {
  if (value == null) return MISSING;
  const size = Math.abs(value);
  const text =
    size === 0 ? "0" : size >= 1e-3 ? String(+value.toPrecision(4)) : value.toExponential(2);
  return minus(text) + (unit ? ` ${unit}` : "");
}

// What a plot is over: the name of its axis and of its column, a place on it in words, and
// the cursors on it, which every plot over the same has.
const over = (label, column, at, log = false) => ({ label, column, at, log, cursors: { A: null, B: null } });
const TIME = over("t [s]", "t_s", (t) => `${+t.toFixed(6)} s`);
const FREQUENCY = over("f [Hz]", "f_hz", (f) => reading(f, "Hz"), true);

// Ticks of a logarithmic axis; those without room are null.
function logTicks(u, splits) {
  const plain = (v) => v >= 1e-3 && v < 1e6;
  return splits.map((v) => (v == null ? null : plain(v) ? String(+v.toPrecision(6)) : minus(v.toExponential(0))));
}

// Ticks with as many decimals as the step between them has, not the
// browser's language: two readers of one report see the same numbers.
function ticks(u, splits, axis, space, step) {
  const decimals = Math.max(0, Math.ceil(-Math.log10(step) - 1e-9));
  if (decimals > 5) return splits.map((v) => (v == null ? null : v === 0 ? "0" : minus(v.toExponential(1))));
  const digits = (v) => {
    for (let d = decimals; d < decimals + 3; d++) {
      if (Math.abs(step - +step.toFixed(d)) < step * 1e-6) return v.toFixed(d);
    }
    return v.toFixed(decimals);
  };
  return splits.map((v) => (v == null ? null : minus(digits(Math.abs(v) < step / 1e6 ? 0 : v))));
}

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
function extent(...columns) {
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

// The range of the vertical axis. `include` belongs to the whole picture
// (limits, the partner plot's range); a reader who zooms in wants the curve.
function verticalRange(include) {
  return (u, low, high) => {
    const [first, last] = u.series[0].idxs ?? [0, u.data[0].length - 1];
    const whole = first === 0 && last === u.data[0].length - 1;
    const values = [low, high, ...(whole ? include : [])].filter((v) => v != null);
    low = Math.min(...values);
    high = Math.max(...values);
    if (!(high > low)) {
      const half = Math.abs(low) * 0.1 || 1;
      return values.length ? [low - half, high + half] : [-1, 1];
    }
    const margin = 0.06 * (high - low);
    return [low - margin, high + margin];
  };
}

// A dashed line across the plot with its name at the right end.
function drawLimit(u, { value, label, below, colour = "c-limit" }) {
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
function shade(u, colour, [x0, x1], [y0, y1]) {
  const { ctx, bbox } = u;
  const clampX = (x) => Math.min(Math.max(x, bbox.left), bbox.left + bbox.width);
  const clampY = (y) => Math.min(Math.max(y, bbox.top), bbox.top + bbox.height);
  const left = x0 == null ? bbox.left : clampX(u.valToPos(x0, "x", true));
  const right = x1 == null ? bbox.left + bbox.width : clampX(u.valToPos(x1, "x", true));
  const top = y1 == null ? bbox.top : clampY(u.valToPos(y1, "y", true));
  const bottom = y0 == null ? bbox.top + bbox.height : clampY(u.valToPos(y0, "y", true));
  ctx.fillStyle = cssColour(colour);
  ctx.fillRect(left, top, right - left, bottom - top);
}

// uPlot remembers what it last set on the canvas and would not notice ours.
function apart(paint) {
  return (u) => {
    u.ctx.save();
    paint(u);
    u.ctx.restore();
  };
}

// The zero line, a little stronger than the grid.
function drawZero(u) {
  const { ctx, bbox } = u;
  const y = u.valToPos(0, "y", true);
  // A logarithmic axis has none.
  if (!(y >= bbox.top && y <= bbox.top + bbox.height)) return;
  ctx.fillStyle = cssColour("rule");
  ctx.fillRect(bbox.left, Math.round(y), bbox.width, Math.max(1, Math.round(devicePixelRatio)));
}

// Short marks on the lower edge.
function drawMarks(u, times) {
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
const columns = (u, series) => (u.data[0] ? [u.data[0], u.data[series]] : u.data[series]);

// Leads `pen` along a curve: every point, at fractions of a pixel; a hole where
// a value is null, steps where a value is held.
function follow(u, series, first, last, pen, held) {
  const [xs, ys] = columns(u, series);
  let before = null;
  // One point more on either side, so that a zoomed curve reaches the edge.
  for (let i = Math.max(0, first - 1); i <= Math.min(xs.length - 1, last + 1); i++) {
    if (ys[i] == null) {
      before = null;
      continue;
    }
    const [x, y] = [u.valToPos(xs[i], "x", true), u.valToPos(ys[i], "y", true)];
    if (before == null) pen.moveTo(x, y);
    else {
      if (held) pen.lineTo(x, before);
      pen.lineTo(x, y);
    }
    before = y;
  }
}

// A path builder for uPlot.
function polyline(u, series, first, last) {
  const stroke = new Path2D();
  follow(u, series, first, last, stroke, false);
  return { stroke, fill: null, clip: null, band: null, gaps: null, flags: 1 };
}

// Names of curves are switches: a click, Enter or Space shows and hides.
function switches(u, caption) {
  const names = [...caption.querySelectorAll(".u-series th")].slice(1);
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
function colourMarkers(caption, curves) {
  const markers = [...caption.querySelectorAll(".u-marker")];
  markers.slice(-curves.length).forEach((marker, i) => {
    const { colour, dash } = curves[i];
    marker.style.borderTopColor = `var(--${colour})`;
    if (dash) marker.style.borderTopStyle = dash[0] < 4 ? "dotted" : "dashed";
  });
}

// Draws `plot` = { over, x, curves: [{ label, y, unit, column, colour, width, dash, held }],
// yLabel, yLog, ySteps, include, limits, marks, behind } into `figure`.
function drawChart(figure, plot, group) {
  const box = figure.querySelector(".plot");
  const caption = figure.querySelector("figcaption");
  // Steps on whole pixels are crisp, slopes on whole pixels are stairs; but
  // only on whole pixels does uPlot merge points, which long runs need.
  const smooth = plot.x.length > 20000 ? {} : { paths: polyline, pxAlign: 0 };
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
      mount: (u, element) => caption.appendChild(element),
      markers: { show: true, width: 0 },
    },
    scales: {
      x: plot.over.log ? { time: false, distr: 3, range: (u, low, high) => [low, high] } : { time: false },
      y: plot.yLog
        ? { distr: 3, range: (u, low, high) => uPlot.rangeLog(low, high, 10, true) }
        : { range: verticalRange(plot.include ?? []) },
    },
    axes: [axis(plot.over.label, 22, 50, plot.over.log), axis(plot.yLabel, 46, 20, plot.yLog, plot.ySteps)],
    series: [
      { label: plot.over.label[0], value: (u, x) => (x == null ? MISSING : plot.over.at(x)) },
      ...plot.curves.map((curve) => ({
        label: curve.label,
        value: (u, v) => reading(v, curve.unit),
        stroke: () => cssColour(curve.colour),
        width: curve.width ?? 1.4,
        dash: curve.dash,
        points: { show: false },
        ...(curve.held ? { paths: uPlot.paths.stepped({ align: 1 }) } : smooth),
      })),
    ],
    hooks: {
      setLegend: [(u) => caption.classList.toggle("reading", u.cursor.idx != null)],
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
