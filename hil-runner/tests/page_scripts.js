// The page's scripts without a browser: hand-made curves through the functions that
// align, read and save them. Prints the SVG, which the Rust test reads as XML.
"use strict";

const assert = require("node:assert");
const fs = require("node:fs");

// Names of the scripts are the program's own; the last ones draw at once and need a page.
const files = ["chart", "curves", "cursors", "save"];
const assets = `${__dirname}/../assets/`;
const sources = files.map((file) => fs.readFileSync(`${assets}${file}.js`, "utf8")).join("");
globalThis.document = { documentElement: {} };
globalThis.getComputedStyle = () => ({ getPropertyValue: (name) => ` ${COLOURS[name] ?? "#000"}` });
globalThis.devicePixelRatio = 2;
const COLOURS = { "--c-band": "rgba(90, 100, 110, 0.1)", "--ground": "#fff" };
const { aligned, valueAt, svgOf, csvOf, cursors, shade } = new Function(
  `${sources}; return { aligned, valueAt, svgOf, csvOf, cursors, shade };`,
)();

// A curve that jumps at 1 from 2 to 4, and one that holds, on times of their own.
const jumping = { t: [0, 1, 1, 2], y: [0, 2, 4, 6] };
const held = { t: [0, 0.5, 1.5], y: [10, 20, 30], held: true };
const both = aligned([jumping, held]);
assert.deepStrictEqual(both.x, [0, 0.5, 1, 1, 1.5, 2]);
assert.deepStrictEqual(both.curves[0].y, [0, 1, 2, 4, 5, 6]);
assert.deepStrictEqual(both.curves[1].y, [10, 20, 20, 20, 30, null]);
// The contrast: what does not hold is a straight line.
assert.deepStrictEqual(aligned([jumping, { ...held, held: false }]).curves[1].y[2], 25);

const at = (t, curve = jumping) => valueAt(curve.t, curve.y, t, curve.held);
assert.deepStrictEqual([at(0.25), at(1), at(1.5), at(2), at(-1), at(3)], [0.5, 4, 5, 6, null, null]);
assert.deepStrictEqual([at(0.75, held), at(0.25, held)], [20, 10]);

// A view as report.js makes it: 100 pixels of canvas a second and 10 a unit.
function view(change = {}) {
  const curves = [
    { label: "a<b>", unit: "m/s²", column: "acc_mps2", of: 'x,"y"', colour: "c-plain" },
    { label: "measured", unit: "V", column: "motor_voltage_v", colour: "text", dash: [2, 3], held: true },
    { label: "hidden", unit: "A", column: "current_a", colour: "text" },
  ];
  const chart = {
    width: 150,
    height: 60,
    bbox: { left: 50, top: 10, width: 200, height: 100 },
    data: [[0, 1, 1, 2], [0, 2, 4, 1 / 3], [10, null, 1, 2], [7, 7, 7, 7]],
    scales: { x: { min: 0, max: 2 }, y: { min: 0, max: 10 } },
    series: [{ idxs: [0, 3] }, { show: true }, { show: true }, { show: false }],
    axes: [
      { label: "t [s]", _splits: [0, 1, 2], _values: ["0", "1", "2"] },
      { label: "acc [m/s²]", _splits: [0, 5, 10], _values: ["0", "5", "10"] },
    ],
    valToPos: (v, scale) => (scale === "x" ? 50 + 100 * v : 110 - 10 * v),
    ...change,
  };
  const limits = [{ value: 9, label: "+V_max" }];
  const behind = (u) => shade(u, "c-band", [null, null], [1, 2]);
  return { chart, plot: { curves, limits, behind, marks: [1] }, title: "case & plot\u0001" };
}

// What is hidden is left out, numbers have all their digits, holes are empty.
const csv = 't_s,"x,""y"".acc_mps2",motor_voltage_v\n0,0,10\n1,2,\n1,4,1\n2,0.3333333333333333,2\n';
assert.strictEqual(csvOf(view()), csv);
const zoomed = csvOf(view({ scales: { x: { min: 0.5, max: 1.5 } } }));
assert.strictEqual(zoomed, 't_s,"x,""y"".acc_mps2",motor_voltage_v\n1,2,\n1,4,1\n');

cursors.A = 0.5;
const svg = svgOf(view());
for (const part of [
  // The curve at its places, the jump upright; the held one in steps, after its hole.
  'd="M50 110L150 90L150 70L250 106.67"',
  'd="M50 10M150 100L250 100L250 90"',
  'stroke-dasharray="4 6"',
  ">a&#60;b&#62; [m/s²]<", ">measured [V]<", "<title>case &#38; plot\ufffd</title>",
  ">t [s]<", ">acc [m/s²]<", ">10<", ">+V_max<", ">A<",
  '<rect x="50" y="90" width="200" height="10" fill="rgb(90, 100, 110)" fill-opacity="0.1"/>',
  '<svg xmlns="http://www.w3.org/2000/svg" width="150"',
]) {
  assert.ok(svg.includes(part), `${part} is not in\n${svg}`);
}
for (const part of ["hidden", "<image", "href", "NaN", "undefined"]) {
  assert.ok(!svg.includes(part), `${part} is in\n${svg}`);
}
// The contrast: another value is another place.
const moved = view();
moved.chart.data[1][1] = 3;
assert.ok(svgOf(moved).includes('d="M50 110L150 80L150 70'));
process.stdout.write(svg);
