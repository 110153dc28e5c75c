import {
  columns, cssColour, drawLimit, drawMarks, drawZero, element, follow,
} from "./chart.js";
import { inSight } from "./cursors.js";
import { drawPlaces } from "./plane.js";

// A plot as SVG, PNG or CSV: what is visible of it.

// The name of SVG. It is no address, and in two parts a search for addresses, which
// this page has none of, does not find it.
/** @import { Curve, Plot, View } from "./chart.js" */

const SVG_NAME = ["http", "//www.w3.org/2000/svg"].join(":");

// XML has no place for most control characters.
/** @param {unknown} text */
const escaped = (text) =>
  String(text)
    .replace(/[\0-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff]/g, "\ufffd")
    .replace(/[&<>"]/g, (sign) => `&#${sign.charCodeAt(0)};`);
/** @param {number} value */
const round = (value) => +value.toFixed(2);

// Colour with its opacity apart: editors of SVG know no rgba().
/** @param {string} attribute @param {string} colour */
function paint(attribute, colour) {
  const parts = /^rgba\((.*),\s*([\d.]+)\)$/.exec(colour);
  if (!parts) return `${attribute}="${escaped(colour)}"`;
  return `${attribute}="rgb(${parts[1]})" ${attribute}-opacity="${parts[2]}"`;
}

// A drawing context that writes SVG; as much of one as the plots use.
class VectorPen {
  constructor() {
    this.text = "";
    this.path = "";
    /** @type {number[]} */
    this.dash = [];
    this.strokeStyle = this.fillStyle = "";
    this.lineWidth = 1;
    this.textAlign = this.textBaseline = "";
    this.font = "12px";
  }
  save() {}
  restore() {}
  /** @param {number[]} dash */
  setLineDash(dash) {
    this.dash = dash;
  }
  beginPath() {
    this.path = "";
  }
  /** @param {number} x @param {number} y */
  moveTo(x, y) {
    this.path += `M${round(x)} ${round(y)}`;
  }
  /** @param {number} x @param {number} y */
  lineTo(x, y) {
    this.path += `L${round(x)} ${round(y)}`;
  }
  stroke() {
    const dash = this.dash.length ? ` stroke-dasharray="${this.dash.join(" ")}"` : "";
    const look = `${paint("stroke", this.strokeStyle)} stroke-width="${this.lineWidth}"${dash}`;
    this.text += `<path d="${this.path}" fill="none" ${look} stroke-linejoin="round"/>\n`;
  }
  /** @param {number} x @param {number} y @param {number} width @param {number} height */
  fillRect(x, y, width, height) {
    const place = `x="${round(x)}" y="${round(y)}" width="${round(width)}" height="${round(height)}"`;
    this.text += `<rect ${place} ${paint("fill", this.fillStyle)}/>\n`;
  }
  /** @param {string} text @param {number} x @param {number} y */
  fillText(text, x, y, turned = false) {
    /** @type {Record<string, string>} */
    const anchors = { right: "end", center: "middle" };
    const anchor = anchors[this.textAlign] ?? "start";
    const size = parseFloat(/[\d.]+px/.exec(this.font)?.[0] ?? "12");
    /** @type {Record<string, number>} */
    const downs = { top: 0.8, middle: 0.35, bottom: -0.2 };
    const down = downs[this.textBaseline] ?? 0;
    const turn = turned ? ` transform="rotate(-90 ${round(x)} ${round(y)})"` : "";
    this.text +=
      `<text x="${round(x)}" y="${round(y)}" dy="${round(down * size)}"${turn} text-anchor="${anchor}" ` +
      `font-size="${size}" ${paint("fill", this.fillStyle)}>${escaped(text)}</text>\n`;
  }
}

// The plot as SVG, in pixels of the canvas that it is a copy of; `bare` without title and
// legend, for the page, which has them.
/** @param {View} view */
export function svgOf({ chart, plot, title }, bare = false) {
  const px = devicePixelRatio;
  const pen = new VectorPen();
  const { left, top, width, height } = chart.bbox;
  // Within a page the name of an area is its own.
  const { area = "area" } = chart;
  const [right, bottom] = [left + width, top + height];
  // uPlot's place and scales, our pen.
  const u = {
    ctx: pen,
    bbox: chart.bbox,
    data: chart.data,
    valToPos: (/** @type {number} */ value, /** @type {string} */ scale) => chart.valToPos(value, scale, true),
  };
  /** @param {number} x0 @param {number} y0 @param {number} x1 @param {number} y1 @param {string} colour */
  const line = (x0, y0, x1, y1, colour) => {
    Object.assign(pen, { strokeStyle: cssColour(colour), lineWidth: px, dash: [] });
    pen.beginPath();
    pen.moveTo(x0, y0);
    pen.lineTo(x1, y1);
    pen.stroke();
  };
  /**
   * @param {string} text @param {number} x @param {number} y @param {string} colour @param {string} textAlign
   * @param {string} textBaseline @param {boolean} [turned]
   */
  const words = (text, x, y, colour, textAlign, textBaseline, turned) => {
    Object.assign(pen, { fillStyle: cssColour(colour), textAlign, textBaseline });
    pen.fillText(text, x, y, turned);
  };
  const clipped = (/** @type {() => void} */ draw) => {
    pen.text += `<g clip-path="url(#${area})">\n`;
    draw();
    pen.text += "</g>\n";
  };

  clipped(() => plot.behind?.(u));
  pen.font = `${12 * px}px`;
  const [xAxis, yAxis] = chart.axes;
  xAxis._splits.forEach((/** @type {number} */ t, /** @type {number} */ i) => {
    const x = u.valToPos(t, "x");
    if (xAxis._values[i] == null || x < left || x > right) return;
    line(x, top, x, bottom + 4 * px, "grid");
    words(xAxis._values[i], x, bottom + 7 * px, "muted", "center", "top");
  });
  yAxis._splits.forEach((/** @type {number} */ value, /** @type {number} */ i) => {
    const y = u.valToPos(value, "y");
    if (yAxis._values[i] == null || y < top || y > bottom) return;
    line(left - 4 * px, y, right, y, "grid");
    words(yAxis._values[i], left - 7 * px, y, "muted", "right", "middle");
  });
  words(xAxis.label, left + width / 2, bottom + 24 * px, "muted", "center", "top");
  words(yAxis.label, 12 * px, top + height / 2, "muted", "center", "middle", true);
  drawZero(u);
  const shown = plot.curves.map((curve, i) => /** @type {[Curve, number]} */ ([curve, i + 1]));
  const visible = shown.filter(([, series]) => chart.series[series].show);
  const look = (/** @type {Curve} */ { colour, width: thick, dash }) => ({
    strokeStyle: cssColour(colour),
    lineWidth: (thick ?? 1.4) * px,
    dash: (dash ?? []).map((part) => part * px),
  });
  clipped(() => {
    for (const [curve, series] of visible) {
      Object.assign(pen, look(curve));
      pen.beginPath();
      const [first, last] = chart.series[0].idxs ?? [0, columns(u, series)[0].length - 1];
      follow(u, series, first, last, pen, curve.held);
      pen.stroke();
    }
  });
  for (const limit of plot.limits ?? []) drawLimit(u, limit);
  if (plot.marks) drawMarks(u, plot.marks);
  pen.font = `${12 * px}px`;
  const { cursors } = plot.over;
  for (const name of chart.scales ? ["A", "B"] : []) {
    if (!inSight(chart, cursors[name])) continue;
    const x = u.valToPos(cursors[name] ?? 0, "x");
    line(x, top, x, bottom, "text");
    words(name, x + 3 * px, top, "text", "left", "top");
  }
  if (!chart.scales) drawPlaces(u, pen, plot, chart.series);
  // Title and legend above all this; a name that has no room begins a line.
  const inner = pen.text;
  pen.text = "";
  const whole = chart.width * px;
  if (!bare) words(title, left, 6 * px, "text", "left", "top");
  let [x, y] = [left, 32 * px];
  for (const [curve] of bare ? [] : visible) {
    const label = curve.unit ? `${curve.label} [${curve.unit}]` : curve.label;
    const needed = 24 * px + 0.6 * 12 * px * label.length;
    if (x > left && x + needed > whole) [x, y] = [left, y + 18 * px];
    Object.assign(pen, look(curve));
    pen.beginPath();
    pen.moveTo(x, y);
    pen.lineTo(x + 18 * px, y);
    pen.stroke();
    words(label, x + 23 * px, y, "text", "left", "middle");
    x += needed;
  }
  const head = bare ? 0 : y + 12 * px;
  const tall = chart.height * px + head;
  return (
    `<svg xmlns="${SVG_NAME}" width="${chart.width}" height="${round(tall / px)}" ` +
    `viewBox="0 0 ${round(whole)} ${round(tall)}" font-family="system-ui, sans-serif">\n` +
    `<title>${escaped(title)}</title>\n` +
    `<clipPath id="${area}"><rect x="${round(left)}" y="${round(top)}" width="${round(width)}" height="${round(height)}"/></clipPath>\n` +
    `<rect width="100%" height="100%" ${paint("fill", cssColour("ground"))}/>\n` +
    `${pen.text}<g transform="translate(0 ${round(head)})">\n${inner}</g>\n</svg>\n`
  );
}

/** @param {string} text */
const cell = (text) => (/[",\r\n]/.test(text) ? `"${text.replace(/"/g, '""')}"` : text);
/** @param {(string | number)[][]} lines */
const csvLines = (lines) => lines.map((line) => line.join(",") + "\n").join("");

// The visible curves within the visible time; names of columns carry the unit.
/** @param {View} view @returns {string} */
export function csvOf({ chart, plot }) {
  if (!chart.scales) return csvOfPlane(chart, plot);
  const { min, max } = chart.scales.x;
  const visible = plot.curves
    .map((curve, i) => /** @type {[Curve, any[]]} */ ([curve, chart.data[i + 1]]))
    .filter((_, i) => chart.series[i + 1].show);
  const lines = [[plot.over.column, ...visible.map(([{ column, of }]) => cell(of ? `${of}.${column}` : (column ?? "")))]];
  chart.data[0].forEach((/** @type {number} */ t, /** @type {number} */ i) => {
    if (t >= min && t <= max) lines.push([t, ...visible.map(([, y]) => y[i] ?? "")]);
  });
  return csvLines(lines);
}

// The visible curves of a plane one below the other: each has frequencies of its own.
/** @param {any} chart @param {Plot} plot */
function csvOfPlane(chart, plot) {
  const visible = plot.curves.filter(({ f }, i) => f && chart.series[i + 1].show);
  const rows = visible.flatMap(({ f = [], x = [], y, of = "" }) => f.map((frequency, i) => [cell(of), frequency, x[i], y[i]]));
  return csvLines([["loop", plot.over.column, ...(plot.columns ?? [])], ...rows]);
}

// The picture of an SVG, two pixels for each of its own.
/** @param {string} svg @returns {Promise<Blob>} */
async function pngOf(svg) {
  const image = new Image();
  image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(svg)}`;
  await image.decode();
  const canvas = element("canvas", { width: 2 * image.width, height: 2 * image.height });
  canvas.getContext("2d")?.drawImage(image, 0, 0, canvas.width, canvas.height);
  return new Promise((done) => canvas.toBlob((blob) => done(/** @type {Blob} */ (blob)), "image/png"));
}

/** @type {Record<string, (view: View) => Blob | Promise<Blob>>} */
const FORMATS = {
  SVG: (view) => new Blob([svgOf(view)], { type: "image/svg+xml" }),
  PNG: (view) => pngOf(svgOf(view)),
  CSV: (view) => new Blob([csvOf(view)], { type: "text/csv" }),
};

// The menu of a plot.
/** @param {View} view */
export function saveMenu(view) {
  const menu = element("details", { className: "save" });
  const items = Object.entries(FORMATS).map(([format, make]) => {
    const item = element("button", { type: "button", textContent: format });
    item.addEventListener("click", async () => {
      menu.open = false;
      const href = URL.createObjectURL(await make(view));
      const name = view.title.replace(/[^\p{L}\p{N}]+/gu, "-");
      element("a", { href, download: `${name}.${format.toLowerCase()}` }).click();
      setTimeout(() => URL.revokeObjectURL(href), 60000);
    });
    return item;
  });
  const summary = element("summary", { textContent: "Save" });
  summary.setAttribute("aria-label", `Save: ${view.title}`);
  menu.append(summary, element("div", {}, ...items));
  menu.addEventListener("keydown", (event) => {
    if (event.key !== "Escape") return;
    menu.open = false;
    summary.focus();
  });
  const leave = (/** @type {Event} */ { target }) => menu.contains(/** @type {Node} */ (target)) || (menu.open = false);
  for (const event of ["pointerdown", "focusin"]) document.addEventListener(event, leave);
  return menu;
}
