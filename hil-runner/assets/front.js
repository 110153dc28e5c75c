import { cssColour, element, extent, reading } from "./chart.js";
import { nearest } from "./plane.js";

// The Pareto front of a tune: a point for each setting that no other one beats in both figures.

// 1, 2 and 5 times the powers of ten that a range may be divided by.
const STEPS = Array.from({ length: 36 }, (_, i) => [1, 2, 5][i % 3] * 10 ** (Math.floor(i / 3) - 7));

// A range with some room around its values.
function roomy(values) {
  const [low, high] = extent(values);
  const room = 0.06 * (high - low) || 0.05 * Math.abs(high) || 1;
  return [low - room, high + room];
}

// `tune` as its page has it: { front: [{ aims }], setting, labels: [{ label, unit }] }.
export function frontPlot({ front, after, labels: [xLabel, yLabel] }) {
  const points = front.map(({ aims: [x, y] }) => [x, y]);
  const [x, y] = [0, 1].map((k) => points.map((point) => point[k]));
  const named = ({ label, unit }) => (unit ? `${label} [${unit}]` : label);
  const all = [...points, after];
  const axis = (k, label) => ({ label: named(label), range: roomy(all.map((point) => point[k])), steps: STEPS });
  return {
    over: { name: "point", column: "point", at: (i) => `${i}`, cursors: {} },
    curves: [
      { f: x.map((_, i) => i + 1), x, y, of: "front", label: "front", colour: "c-carriage" },
      { x: [], y: [], label: "the setting that is written", colour: "c-vermilion" },
    ],
    x: axis(0, xLabel),
    y: axis(1, yLabel),
    columns: labels(xLabel, yLabel),
    read: (a, b) => `${reading(a, xLabel.unit)}, ${reading(b, yLabel.unit)}`,
    behind(u) {
      const px = devicePixelRatio;
      const mark = ([a, b], colour, half) => {
        u.ctx.fillStyle = cssColour(colour);
        u.ctx.fillRect(u.valToPos(a, "x") - half * px, u.valToPos(b, "y") - half * px, 2 * half * px, 2 * half * px);
      };
      mark(after, "c-vermilion", 5);
      points.forEach((point) => mark(point, "c-carriage", 2.5));
    },
  };
}
const labels = (...of) => of.map(({ key }) => key);

// The point under the pointer, and its row of the table below, which points likewise. With the
// overrides of each point, a click on one opens it in the page's simulator.
export function followFront(view, rows, sets) {
  const show = (i) => {
    view.point(i);
    rows.forEach((row, k) => row.classList.toggle("pointed", k + 1 === i));
  };
  const at = (event) => {
    const { left, top } = view.box.getBoundingClientRect();
    const px = devicePixelRatio;
    return nearest(view, (event.clientX - left) * px, (event.clientY - top) * px, 40 * px);
  };
  view.box.addEventListener("pointermove", (event) => show(at(event)));
  view.box.addEventListener("pointerleave", () => show(null));
  rows.forEach((row, k) => {
    row.addEventListener("pointerenter", () => show(k + 1));
    row.addEventListener("pointerleave", () => show(null));
  });
  if (!sets) return;
  const open = (i) => {
    const detail = { title: `point ${i} of the front`, sets: sets[i - 1] };
    document.dispatchEvent(new CustomEvent("open-row", { detail }));
  };
  view.box.addEventListener("click", (event) => {
    const i = at(event);
    if (i) open(i);
  });
  rows.forEach((row, k) => {
    const button = element("button", { type: "button", textContent: k + 1, title: "Open in the simulator" });
    button.addEventListener("click", () => open(k + 1));
    row.cells[0].replaceChildren(button);
  });
}
