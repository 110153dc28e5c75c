// The pages' scripts without a browser: hand-made curves through the functions that
// align, read and save them. Prints the SVG, which the Rust test reads as XML.
"use strict";

const assert = require("node:assert");
const fs = require("node:fs");

// Names of the scripts are the program's own; the last ones draw at once and need a page.
const files = ["chart", "curves", "views", "cursors", "save", "loops", "plane", "plots", "front"];
const assets = `${__dirname}/../assets/`;
// Linked as the program does it, but for the comments.
const linked = (text) => text.replace(/^import [^;]*;\n/gm, "").replace(/^export /gm, "");
const sources = files.map((file) => linked(fs.readFileSync(`${assets}${file}.js`, "utf8"))).join("");
globalThis.document = { documentElement: {} };
globalThis.ResizeObserver = class {};
globalThis.getComputedStyle = () => ({ getPropertyValue: (name) => ` ${COLOURS[name] ?? "#000"}` });
globalThis.devicePixelRatio = 2;
const COLOURS = { "--c-band": "rgba(90, 100, 110, 0.1)", "--ground": "#fff" };
const names =
  "aligned, valueAt, svgOf, csvOf, shade, TIME, FREQUENCY, logTicks, " +
  "decibels, phases, modulusCircle, loopsOf, loopPlots, planeOf, placeAt, nearest, frontPlot";
const {
  aligned, valueAt, svgOf, csvOf, shade, TIME, FREQUENCY, logTicks,
  decibels, phases, modulusCircle, loopsOf, loopPlots, planeOf, placeAt, nearest, frontPlot,
} = new Function(`${sources}; return { ${names} };`)();

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
  return { chart, plot: { over: TIME, curves, limits, behind, marks: [1] }, title: "case & plot\u0001" };
}

// What is hidden is left out, numbers have all their digits, holes are empty.
const csv = 't_s,"x,""y"".acc_mps2",motor_voltage_v\n0,0,10\n1,2,\n1,4,1\n2,0.3333333333333333,2\n';
assert.strictEqual(csvOf(view()), csv);
const zoomed = csvOf(view({ scales: { x: { min: 0.5, max: 1.5 } } }));
assert.strictEqual(zoomed, 't_s,"x,""y"".acc_mps2",motor_voltage_v\n1,2,\n1,4,1\n');

TIME.cursors.A = 0.5;
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

const close = (value, wanted, by = 1e-9) =>
  assert.ok(Math.abs(value - wanted) <= by, `${value} is not ${wanted}`);
const polar = (degrees) => ({
  re: Math.cos((degrees * Math.PI) / 180),
  im: Math.sin((degrees * Math.PI) / 180),
});
const columnsOf = (points) => [points.map(({ re }) => re), points.map(({ im }) => im)];

// A phase that falls through −180° and −360° goes on falling; the raw angle jumps back.
const falling = [-90, -170, -190, -300, -390, -540];
const unwrapped = phases(...columnsOf(falling.map((degrees) => polar(degrees))));
unwrapped.forEach((phase, i) => close(phase, falling[i]));
const raw = falling.map((degrees) => Math.atan2(polar(degrees).im, polar(degrees).re) * (180 / Math.PI));
close(raw[2], 170);
close(raw[4], -30);
// The low end: two integrators begin at −180° from either side, a sign turned at 0°.
close(phases(...columnsOf([polar(179)]))[0], -181);
close(phases(...columnsOf([polar(-179)]))[0], -179);
close(phases(...columnsOf([polar(0)]))[0], 0);
decibels([10, 0, -0.5], [0, 0.1, 0]).forEach((db, i) => close(db, [20, -20, -6.0205999132796][i]));

// Every point of the circle is 1/2 from −1; a circle around −1.1 would not be.
const circle = modulusCircle();
const distances = (centre) => circle.re.map((re, i) => Math.hypot(re - centre, circle.im[i]));
distances(-1).forEach((distance) => close(distance, 0.5));
assert.ok(distances(-1.1).some((distance) => Math.abs(distance - 0.5) > 0.09));
// In the Nichols plot it reaches from L = −1/2 to −3/2, and to ±30° where a line from 0 touches
// it: sin 30° = 1/2. The contour of M_s = 1.6 would reach to ±38.7°.
const [angles, gains] = [phases(circle.re, circle.im), decibels(circle.re, circle.im)];
close(Math.max(...gains), 3.5218251811136);
close(Math.min(...gains), -6.0205999132796);
close(Math.max(...angles), -150);
close(Math.min(...angles), -210);
angles.forEach((phase, i) => i && assert.ok(Math.abs(phase - angles[i - 1]) < 5));

// L = 10/(jω) at ω = 1, 10, 100, in the gap a tenth of it, as a run has them.
const integrator = (gain) => ({
  frequency_hz: [1, 10, 100], re: [0, 0, 0], im: [-gain, -gain / 10, -gain / 100], stiffness_n_per_um: null,
});
const loop = (name, gain) => ({ name, curves: { contact: integrator(gain), gap: integrator(gain / 10) } });
const run = (name, ...loops) => ({ name, loop_curves: { loops } });
const one = loopsOf([run("x", loop("", 10))]);
assert.deepStrictEqual(one.map(({ label, look }) => [label, look.dash]), [
  ["in contact", undefined], ["in the gap", undefined],
]);
// Before is dashed, after is not; gains that hold no longer are dotted.
const pair = loopsOf([run("before", loop("", 10)), run("after", loop("until 1 s", 5), loop("from 1 s", 2))]);
assert.deepStrictEqual(pair.filter((_, i) => i % 2 === 0).map(({ label, look }) => [label, look.dash]), [
  ["before, in contact", [6, 4]], ["after, until 1 s, in contact", [2, 3]], ["after, from 1 s, in contact", undefined],
]);
assert.strictEqual(loopsOf([{ name: "continuous", loop_curves: null }]).length, 0);

const gain = loopPlots.bode_gain(one);
gain.curves[0].y.forEach((db, i) => close(db, 20 - 20 * i));
gain.curves[1].y.forEach((db, i) => close(db, -20 * i));
assert.ok(loopPlots.bode_phase(one).curves.every(({ y }) => y.every((phase) => Math.abs(phase + 90) < 1e-9)));
// An unstable loop has no stiffness, and the picture says so.
assert.strictEqual(loopPlots.stiffness(one).curves.length, 0);
const stiff = loopsOf([run("x", { name: "", curves: { contact: { ...integrator(10), stiffness_n_per_um: [3, 2, 50] } } })]);
assert.strictEqual(loopPlots.stiffness(stiff).limits[0].value, 2);

// A plane of 578 by 296 pixels has 500 by 250 within: a unit is 50 pixels on both axes.
const nyquist = { over: FREQUENCY, ...loopPlots.nyquist(one) };
const plane = (plot) => ({ series: [{}, ...plot.curves.map(() => ({ show: true }))], ...planeOf(plot, 578, 296) });
const chart = plane(nyquist);
const at2 = (x, y) => [chart.valToPos(x, "x") / 2, chart.valToPos(y, "y") / 2];
const [[x0, y0], [x1, y1]] = [at2(-1, 0), at2(0, 1)];
close(x1 - x0, 50);
close(y0 - y1, 50);
close(x0, 64 + 250 - 25);
close(y0, 6 + 125);
// The contrast: without the same unit the plane fills its place.
const stretched = planeOf({ ...nyquist, square: false }, 578, 296);
close((stretched.valToPos(0, "x") - stretched.valToPos(-1, "x")) / 2, 100);
// The pointer at −j, or a little beside it, is at 10 Hz; farther than its reach at none.
const near = (x, y) => nearest({ chart, plot: nyquist }, 2 * at2(x, y)[0], 2 * at2(x, y)[1], 40);
assert.deepStrictEqual([near(0, -1), near(0.1, -1.1), near(2, 2)], [10, 10, null]);
assert.deepStrictEqual(placeAt(nyquist.curves[0], 55), [0, -0.55]);
assert.deepStrictEqual([placeAt(nyquist.curves[0], 200), placeAt(nyquist.curves[2], 10)], [null, null]);

FREQUENCY.cursors.A = 10;
const drawn = { chart: { ...chart, area: "area-7" }, plot: nyquist, title: "Nyquist" };
const saved = svgOf(drawn);
const [mark, there] = [at2(0, -1), (value) => +(2 * value).toFixed(2)];
for (const part of [
  `x="${there(mark[0]) - 6}" y="${there(mark[1]) - 6}" width="12" height="12"`,
  ">A<", ">Re L<", ">Im L<", "<title>Nyquist</title>", ">|1 + L| = 0.5 (M_s = 2)<", 'id="area-7"', "url(#area-7)",
]) {
  assert.ok(saved.includes(part), `${part} is not in\n${saved}`);
}
const bare = svgOf(drawn, true);
assert.ok(!bare.includes(">|1 + L|") && !`${saved}${bare}`.includes("NaN"));
FREQUENCY.cursors.A = 20000;
assert.ok(!svgOf(drawn).includes(">A<"));
chart.series[2].show = false;
assert.strictEqual(
  csvOf({ chart, plot: nyquist }), "loop,f_hz,re,im\ncontact,1,0,-10\ncontact,10,0,-1\ncontact,100,0,-0.1\n",
);
// The Nichols plot reaches from −225° to −90° at least, and to where a loop is in sight.
assert.deepStrictEqual(loopPlots.nichols(one).x.range, [-225, -90]);
const late = { ...integrator(10), re: [-0.1, 0, 10], im: [0, 0.1, 0] };
assert.deepStrictEqual(
  loopPlots.nichols(loopsOf([run("x", { name: "", curves: { contact: late } })])).x.range, [-360, -90],
);
assert.deepStrictEqual(logTicks(null, [0.1, null, 2000, 1e7]), ["0.1", null, "2000", "1e+7"]);

// A front: both axes with their units, all points and the setting that is written in sight.
const tuned = frontPlot({
  front: [{ aims: [1, 9] }, { aims: [2, 4] }, { aims: [5, 3] }],
  after: [2, 12],
  labels: [{ key: "peak_following_error_mm", label: "Following", unit: "mm" }, { key: "passes", label: "Passes", unit: "" }],
});
assert.deepStrictEqual([tuned.x.label, tuned.y.label], ["Following [mm]", "Passes"]);
assert.deepStrictEqual([tuned.x.range, tuned.y.range], [[0.76, 5.24], [2.46, 12.54]]);
assert.deepStrictEqual([tuned.curves[0].f, tuned.curves[0].x, tuned.curves[0].y], [[1, 2, 3], [1, 2, 5], [9, 4, 3]]);
const front = plane(tuned);
const pointed = (x, y) => nearest({ chart: front, plot: tuned }, front.valToPos(x, "x"), front.valToPos(y, "y"), 40);
assert.deepStrictEqual([pointed(2, 4), pointed(5, 3.2), pointed(4, 10)], [2, 3, null]);
const marked = svgOf({ chart: { ...front, area: "area-8" }, plot: tuned, title: "front" });
const squares = (size) => marked.split(`width="${size}" height="${size}"`).length - 1;
assert.deepStrictEqual([squares(20), squares(10)], [1, 3]);

// The live page's modules: linked after the shared ones they parse as one script, in which no name stands twice.
{
  const page = `${__dirname}/../web/page/`;
  const ofPage = (...names) => names.map((file) => linked(fs.readFileSync(`${page}${file}.js`, "utf8"))).join("");
  const modules = ["../../assets/packed", "simulator", "state", "keys", "pictures", "figures", "map", "share", "live", "start"];
  new Function(sources + ofPage(...modules));
  assert.throws(() => new Function(sources + ofPage(...modules, "state")), /already been declared/);

  const live = "State, fragmentOf, readFragment, rangeOf, valueAtShare, shareOf, numberOf, setWords, commandOf, standingOf";
  const {
    State, fragmentOf, readFragment, rangeOf, valueAtShare, shareOf, numberOf, setWords, commandOf, standingOf,
  } = new Function(`${sources}${ofPage("state", "keys", "share", "figures")}; return { ${live} };`)();

  // A link is a run: what goes into the address comes out of it, whatever its letters.
  const base = { name: "axis", file: "axis.toml", text: "", sets: ["controller.kp=2", "run.duration_s=2"], hash: "abc", version: "1" };
  const known = (path) => path.startsWith("controller.") || path === "motion.profile";
  const changes = { "controller.kp": "4", "motion.profile": "a&b=c %.csv" };
  const address = fragmentOf({ base, changes });
  assert.strictEqual(address, "#controller.kp=4&motion.profile=a%26b%3Dc%20%25.csv&v=1&case=abc");
  assert.deepStrictEqual(readFragment(address, base, known), { changes, sentences: [] });
  assert.strictEqual(fragmentOf({ base, changes: {} }), "");
  // What was tampered with is left out and told, the rest is taken.
  const told = (fragment) => readFragment(fragment, base, known);
  for (const [part, word] of [["x.y=1", "no key"], ["%zz=1", "percent-coded"], ["controller.kp=", "percent-coded"], ["v=2", "version 2"], ["case=d", "another case"], ["controller.kd_s=2", "twice"]]) {
    const { changes: taken, sentences } = told(`#controller.kd_s=1&${part}`);
    assert.deepStrictEqual(taken, { "controller.kd_s": "1" });
    assert.ok(sentences.length === 1 && sentences[0].includes(word), `${part}: ${sentences}`);
  }

  // A key of the page stands for the command line's, and for the other ways to say the same.
  const state = new State(base);
  state.excludes = { "controller.kp_v": ["controller.kp"], "controller.kp": ["controller.kp_v"] };
  state.set("controller.kp_v", "30");
  assert.deepStrictEqual(state.sets, ["run.duration_s=2", "controller.kp_v=30"]);
  state.keep();
  state.set("controller.kp", "5");
  assert.deepStrictEqual(state.sets, ["run.duration_s=2", "controller.kp=5"]);
  assert.ok(state.step(-1));
  assert.deepStrictEqual(state.now.changes, { "controller.kp_v": "30" });
  assert.ok(state.step(-1) && !state.step(-1));
  assert.deepStrictEqual(state.sets, base.sets);
  assert.ok(state.step(1) && state.step(1) && !state.step(1));
  assert.deepStrictEqual(state.now.changes, { "controller.kp": "5" });

  // Sliders: a decade each way of a gain, 0 at the left end where it is allowed; a narrow range whole.
  const gain = { kind: "number", low: 0, high: null, above: false };
  const range = rangeOf(gain, 3.2);
  close(range.low, 0.32, 1e-12);
  assert.deepStrictEqual([0, 0.5, 1].map((share) => valueAtShare(gain, range, share)), [0, 3.2, 32]);
  assert.strictEqual(valueAtShare({ ...gain, above: true }, range, 0), 0.32);
  close(shareOf(range, 3.2), 0.5, 1e-12);
  const bits = { kind: "whole", low: 2, high: 24, above: false };
  assert.deepStrictEqual([0, 0.49, 1].map((share) => valueAtShare(bits, rangeOf(bits, 14), share)), [2, 13, 24]);
  const force = { kind: "number", low: null, high: null, above: false };
  assert.deepStrictEqual([0, 0.5, 1].map((share) => valueAtShare(force, rangeOf(force, -30), share)), [-60, 0, 60]);
  assert.deepStrictEqual(["1_000", "1e-3", "plant", "", null].map(numberOf), [1000, 0.001, null, null, null]);

  // Words for a POSIX shell.
  assert.strictEqual(setWords(["a.b=4", "c.d=[1, 2]", "e=it's"]), "--set a.b=4 --set 'c.d=[1, 2]' --set 'e=it'\\''s'");
  assert.strictEqual(commandOf("my axis.toml", []), "hil-runner run 'my axis.toml'");

  const verdicts = [{ pass: true }, { pass: false }];
  assert.deepStrictEqual(standingOf({ verdicts, reserved: null }).kind, "fail");
  assert.deepStrictEqual(standingOf({ verdicts: [{ pass: true }], reserved: "All limits kept, but: x" }).kind, "reserved");
  assert.deepStrictEqual(standingOf({ verdicts: [{ pass: true }], reserved: null }).kind, "pass");
}
// The page of a study, but for what draws at once: rows exactly, lines, places.
const page = ["packed", "study"].map((file) => linked(fs.readFileSync(`${assets}${file}.js`, "utf8"))).join("").split("\nasync function start")[0];
const { RowTable, numbers, folded, fitted, quoted } = new Function(
  `${page}; return { RowTable, numbers, folded, fitted, quoted };`,
)();
const exact = [0.1, 1e-300, -3, 5e-324];
const bytes = exact.map((value) => [...Buffer.from(new Float64Array([value]).buffer)]);
const planes = (of) => Buffer.from([0, 1, 2, 3, 4, 5, 6, 7].flatMap((at) => of.map((byte) => byte[at]))).toString("base64");
assert.deepStrictEqual(numbers(planes(bytes), 4).map(Number), exact);
// The contrast: the planes of other rows.
assert.notDeepStrictEqual(numbers(planes([...bytes].reverse()), 4).map(Number), exact);

const table = new RowTable({
  study: "s", base: "paper-2", rows: 2, of: 3, digits: 6, axes: ["controller.kp"],
  sets: [
    { key: "controller.law", value: "sampled" },
    { key: "controller.kp", values: ["3.2", "6.4"] },
    { key: "motion.intervals_s", values: ["[0, 1]", null] },
  ],
  columns: [
    { name: "controller.kp", label: "K_p", unit: "" },
    { name: "pass", label: "Pass", unit: "", values: [true, false] },
    { name: "peak_mm", label: "Peak", unit: "mm", values: [null, 2.5] },
  ],
});
assert.deepStrictEqual(table.run(1), {
  row: 1,
  sets: ["controller.law=sampled", "controller.kp=6.4"],
  figures: { "controller.kp": 6.4, pass: false, peak_mm: 2.5 },
});
assert.strictEqual(table.run(0).sets.at(-1), "motion.intervals_s=[0, 1]");
assert.deepStrictEqual(table.run(0).figures, { "controller.kp": 3.2, pass: true });
assert.deepStrictEqual([table.has(1), table.has(2)], [true, false]);
assert.deepStrictEqual(["a.b=1e-3", "a=[0, 1]"].map(quoted), ["a.b=1e-3", "'a=[0, 1]'"]);

assert.deepStrictEqual(folded("a bc def", 4), ["a bc", "def"]);
const specification = {
  width: 740,
  title: { text: ["A title of many words that a phone has no room for"], subtitle: [] },
  config: { legend: {}, axis: {} },
  layer: [{ encoding: { color: { legend: { columns: 6 } } } }],
};
const phone = fitted(specification, 330);
assert(phone.width < 330 && phone.title.text.length > 1 && phone.layer[0].encoding.color.legend.columns === 1);
assert.deepStrictEqual([fitted(specification, 2000).width, specification.width], [740, 740]);
