import { element, MISSING, minus, reading, within } from "./chart.js";
import { valueAt } from "./curves.js";
import { views } from "./views.js";

// Cursors A and B: two times, the same in every plot over time, with the values of the
// visible curves there and their differences; two frequencies likewise.

// The one that a click or an arrow key moves.
/** @import { View } from "./chart.js" */

let chosen = "A";
/** @param {number | null} a @param {number | null} b */
const less = (a, b) => (a == null || b == null ? null : b - a);

// Rows of a readout: names, at A, at B, difference; times first.
/** @param {View} view @returns {string[][]} */
function readings({ chart, plot }) {
  const { A, B } = plot.over.cursors;
  const place = (/** @type {number | null} */ x) => (x == null ? MISSING : minus(plot.over.at(x)));
  const rows = plot.curves.map(({ label, unit, held }, i) => {
    const at = (/** @type {number | null} */ t) => (t == null ? null : valueAt(chart.data[0], chart.data[i + 1], t, held));
    const [a, b] = [at(A), at(B)];
    return [label, ...[a, b, less(a, b)].map((value) => reading(value, unit))];
  });
  return [
    ["", place(A), place(B), place(less(A, B))],
    ...rows.filter((row, i) => chart.series[i + 1].show),
  ];
}

/** @param {View} view */
function readout(view) {
  const [times, ...rows] = readings(view);
  const choose = (/** @type {string} */ name, /** @type {string} */ time) => {
    const button = element("button", { type: "button", textContent: `${name} ${time}` });
    button.title = `a click into a plot or the arrow keys move cursor ${name}`;
    button.setAttribute("aria-pressed", String(name === chosen));
    button.addEventListener("click", () => moveCursor(view, name, view.plot.over.cursors[name]));
    return element("th", { scope: "col" }, button);
  };
  const clear = element("button", { type: "button", textContent: "Clear" });
  clear.addEventListener("click", () => clearCursors(view));
  const head = element(
    "tr", {}, element("td", {}, clear), choose("A", times[1]), choose("B", times[2]),
    element("th", { scope: "col", textContent: `B − A ${times[3]}` }),
  );
  const line = (/** @type {string[]} */ [name, ...values]) =>
    element(
      "tr", {}, element("th", { scope: "row", textContent: name }),
      ...values.map((value) => element("td", { textContent: value })),
    );
  return element("table", { className: "readout" }, head, ...rows.map(line));
}

// The lines over a plot and the table below it.
/** @param {View} view */
export function showCursors(view) {
  const { chart, figure } = view;
  const { cursors } = view.plot.over;
  // A plane marks the places in its picture.
  if (!chart.over) return chart.redraw();
  for (const name of ["A", "B"]) {
    chart.over.querySelector(`.cursor-${name}`)?.remove();
    if (!inSight(chart, cursors[name])) continue;
    const line = element("div", { className: `cursor cursor-${name}`, textContent: name });
    line.style.left = `${chart.valToPos(cursors[name], "x")}px`;
    chart.over.append(line);
  }
  const old = figure.querySelector(".readout");
  const any = cursors.A != null || cursors.B != null;
  const focused = old?.contains(document.activeElement) && document.activeElement?.textContent?.[0];
  const table = any ? readout(view) : null;
  if (old) table ? old.replaceWith(table) : old.remove();
  else if (table) figure.append(table);
  const buttons = [...(table?.querySelectorAll("button") ?? [])];
  buttons.find((button) => button.textContent[0] === focused)?.focus();
}

/** @param {any} chart @param {number | null} t */
export function inSight(chart, t) {
  const { min, max } = chart.scales.x;
  return t != null && t >= min && t <= max;
}

function showAllCursors() {
  views.forEach(showCursors);
}

/** @param {View} view */
function clearCursors({ plot }) {
  Object.assign(plot.over.cursors, { A: null, B: null });
  chosen = "A";
  showAllCursors();
}

// Moves a cursor in all plots and tells the values of this one.
/** @param {View} view @param {string} name @param {number | null} t */
function moveCursor(view, name, t) {
  const top = view.figure.getBoundingClientRect().top;
  view.plot.over.cursors[name] = t;
  chosen = name;
  showAllCursors();
  // Tables that have come above would push the plot away.
  scrollBy(0, view.figure.getBoundingClientRect().top - top);
  const column = name === "A" ? 1 : 2;
  const [times, ...rows] = readings(view);
  const told = rows.map((row) => `${row[0]} ${row[column]}`).join(", ");
  within(document, "#told").textContent = `cursor ${name} ${times[column]}: ${told}`;
}

// Sets the chosen cursor, or the other one, which does not become the chosen one.
/** @param {View} view @param {boolean} other @param {number} t */
export function setCursor(view, other, t) {
  if (!other) return moveCursor(view, chosen, t);
  const first = chosen;
  moveCursor(view, first === "A" ? "B" : "A", t);
  chosen = first;
  showAllCursors();
}

/** @param {View} view */
export function followPointer(view) {
  const { over } = view.chart;
  const { cursors } = view.plot.over;
  let before = {};
  over.addEventListener("click", (/** @type {MouseEvent} */ event) => {
    if (event.detail > 1) return;
    before = { ...cursors };
    const t = view.chart.posToVal(event.clientX - over.getBoundingClientRect().left, "x");
    setCursor(view, event.shiftKey, t);
  });
  // Two clicks reset the zoom and move no cursor.
  over.addEventListener("dblclick", () => {
    Object.assign(cursors, before);
    showAllCursors();
  });
}

// Keys on a plot: A and B choose a cursor, arrows move it by a pixel, with Shift by
// ten, Escape takes both away.
/** @param {View} view */
export function followKeys(view) {
  const { box } = view;
  box.tabIndex = 0;
  box.setAttribute("aria-keyshortcuts", "A B ArrowLeft ArrowRight Escape");
  box.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const { chart, plot } = view;
    const { min, max } = chart.scales.x;
    const { cursors } = plot.over;
    const middle = chart.over.clientWidth / 2;
    const from = (/** @type {string} */ name) => (inSight(chart, cursors[name]) ? cursors[name] : chart.posToVal(middle, "x"));
    const moved = (/** @type {number} */ pixels) => {
      const to = chart.posToVal(chart.valToPos(from(chosen), "x") + pixels, "x");
      moveCursor(view, chosen, Math.min(max, Math.max(min, to)));
    };
    const step = event.shiftKey ? 10 : 1;
    const key = event.key.toUpperCase();
    if (key === "A" || key === "B") moveCursor(view, key, from(key));
    else if (key === "ARROWLEFT") moved(-step);
    else if (key === "ARROWRIGHT") moved(step);
    else if (key === "ESCAPE") clearCursors(view);
    else return;
    event.preventDefault();
  });
}
