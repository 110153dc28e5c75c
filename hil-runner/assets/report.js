
// Which plots there are, what each shows, and what they do together.

const data = JSON.parse(document.getElementById("plot-data").textContent);
const ACCELERATION = "acceleration [m/s²]";

// Command and carriage of one case: the same vertical scale, else the eye
// compares shapes that are not comparable.
const accelerationRange = (traces) => extent(traces.acc_ref_mps2, traces.acc_mps2);
const commandCurve = (traces, more) => ({
  label: "command", y: traces.acc_ref_mps2, unit: "m/s²", colour: "c-command", ...more,
});
const carriageCurve = (traces, more) => ({
  label: "carriage", y: traces.acc_mps2, unit: "m/s²", colour: "c-carriage", ...more,
});
const plainCurve = (label, y, unit, more) => [{ label, y, unit, colour: "c-plain", ...more }];

// A limit far outside the picture would flatten the curve; it is named in the
// caption instead. 30 % is where the curve still has a third of the height.
const LIMIT_IN_SIGHT = 0.3;

const casePlots = {
  command: (traces) => ({
    curves: [commandCurve(traces, { colour: "text" })],
    yLabel: ACCELERATION,
    include: accelerationRange(traces),
  }),
  carriage: (traces) => ({
    curves: [carriageCurve(traces)],
    yLabel: ACCELERATION,
    include: accelerationRange(traces),
  }),
  acceleration: (traces) => ({
    curves: [commandCurve(traces, { dash: [6, 4] }), carriageCurve(traces)],
    yLabel: ACCELERATION,
    marks: traces.impacts_s,
  }),
  following_error: (traces) => ({
    curves: plainCurve("error", traces.following_error_mm, "mm"),
    yLabel: "x_ref − x [mm]",
    include: [0],
  }),
  voltage: (traces) => ({
    curves: plainCurve("voltage", traces.motor_voltage_v, "V", { held: traces.voltage_held }),
    yLabel: "voltage [V]",
    include: [-traces.voltage_limit_v, traces.voltage_limit_v],
    limits: [
      { value: traces.voltage_limit_v, label: `+V_max = ${traces.voltage_limit_v} V`, below: true },
      { value: -traces.voltage_limit_v, label: `−V_max = −${traces.voltage_limit_v} V` },
    ],
  }),
  current: (traces) => ({
    curves: plainCurve("current", traces.current_a, "A"),
    yLabel: "current [A]",
    include: [0],
  }),
  code: codePlot,
  gap: gapPlot,
};

function codePlot(traces, figure) {
  const plot = {
    curves: plainCurve("code", traces.dac_code, "", { held: true }),
    yLabel: "code",
    include: [0],
  };
  if (!traces.code_limits) return plot;
  const [low, high] = traces.code_limits;
  const [least, most] = extent(traces.dac_code);
  const used = Math.max(most / high, least / low);
  if (used > LIMIT_IN_SIGHT) {
    plot.include = [low, high];
    plot.limits = [
      { value: high, label: minus(`${high}`), below: true },
      { value: low, label: minus(`${low}`) },
    ];
  } else {
    addKey(figure, minus(`range ${low} … ${high}, at most ${Math.ceil(100 * used)} % used`));
  }
  return plot;
}

// The play as a grey band; contact +1 is shaded above it and −1 below it,
// where the joint then is, so that colour is not the only sign.
function gapPlot(traces) {
  const b = traces.backlash_half_deg;
  const plot = { curves: plainCurve("ε", traces.gap_deg, "°"), yLabel: "gap ε [°]", include: [0] };
  if (!(b > 0)) return plot;
  plot.include = [-1.2 * b, 1.2 * b];
  plot.limits = [
    { value: b, label: "+b", colour: "muted" },
    { value: -b, label: "−b", below: true, colour: "muted" },
  ];
  plot.behind = (u) => {
    shade(u, "c-band", [null, null], [-b, b]);
    for (const { start_s, end_s, contact } of traces.contact_intervals) {
      if (contact > 0) shade(u, "c-drive", [start_s, end_s], [b, null]);
      if (contact < 0) shade(u, "c-coast", [start_s, end_s], [null, -b]);
    }
  };
  return plot;
}

// The lowest rung is broad and pale and every next one thinner, so that
// curves that coincide can still be seen to do so.
function ladderPlot() {
  const { rungs } = data.ladder;
  const { x, columns } = merged(rungs.map((rung) => [rung.t_s, rung.acc_mps2]));
  const curve = (rung, i) => ({
    label: rung.name,
    y: columns[i],
    unit: "",
    colour: `c-rung-${Math.min(i, 4)}`,
    width: Math.max(1, 5 - 1.2 * i),
  });
  return { x, curves: rungs.map(curve), yLabel: ACCELERATION };
}

// Curves with times of their own on the times of all of them; between its own
// points each is the straight line that it is drawn as. A time stands as often
// as in the curve that jumps there.
function merged(curves) {
  const x = [];
  const columns = curves.map(() => []);
  const next = curves.map(() => 0);
  for (;;) {
    const t = Math.min(...curves.map(([times], i) => times[next[i]] ?? Infinity));
    if (t === Infinity) return { x, columns };
    const here = curves.map(([times], i) => {
      let end = next[i];
      while (times[end] === t) end++;
      return end - next[i];
    });
    const rows = Math.max(...here);
    for (let row = 0; row < rows; row++) {
      x.push(t);
      curves.forEach(([times, values], i) => {
        const at = next[i];
        if (here[i] > 0) columns[i].push(values[at + Math.min(row, here[i] - 1)]);
        else columns[i].push(between(times, values, at, t));
      });
    }
    here.forEach((points, i) => (next[i] += points));
  }
}

// A curve at time t, which is before its point number `after`.
function between(times, values, after, t) {
  const [v0, v1] = [values[after - 1], values[after]];
  if (v0 == null || v1 == null) return null;
  const [t0, t1] = [times[after - 1], times[after]];
  return v0 + ((v1 - v0) * (t - t0)) / (t1 - t0);
}

function differencePlot(rung, column, label, unit) {
  const y = data.ladder.rungs[rung][column];
  if (!y) return null;
  const curves = plainCurve("difference", y, unit, { colour: `c-rung-${Math.min(rung, 4)}`, width: 1.2 });
  return { x: data.ladder.t_s, curves, yLabel: `${label} [${unit}]`, include: [0] };
}

function addKey(figure, text) {
  const key = document.createElement("span");
  key.className = "key";
  key.textContent = text;
  figure.querySelector("figcaption").append(key);
}

function plotFor(figure) {
  const { plot, case: index, rung } = figure.dataset;
  if (plot === "ladder") return ladderPlot();
  if (plot === "acc_diff") return differencePlot(+rung, "acc_diff_mps2", "Δẍ", "m/s²");
  if (plot === "pos_diff") return differencePlot(+rung, "pos_diff_um", "Δx", "µm");
  const traces = data.cases[+index].traces;
  return { x: traces.t_s, ...casePlots[plot](traces, figure) };
}

// In place of a plot that would be empty or a line along zero.
function noteInstead(figure, text) {
  const note = document.createElement("p");
  note.className = "plot-note";
  note.textContent = text;
  figure.querySelector(".plot").replaceWith(note);
}

const charts = [];

for (const section of document.querySelectorAll("[data-group]")) {
  const reset = section.querySelector("button.reset");
  const group = [];
  for (const figure of section.querySelectorAll("figure[data-plot]")) {
    const plot = plotFor(figure);
    if (!plot || plot.x.length < 2) {
      noteInstead(figure, "No curve recorded.");
      continue;
    }
    if (figure.dataset.rung && extent(plot.curves[0].y).every((v) => v === 0)) {
      noteInstead(figure, "The same in every row.");
      continue;
    }
    const chart = drawChart(figure, plot, section.dataset.group);
    const box = figure.querySelector(".plot");
    const [low, high] = extent(...plot.curves.map((curve) => curve.y));
    box.setAttribute("aria-label", `${box.getAttribute("aria-label")}; from ${reading(low)} to ${reading(high)}`);
    charts.push({ chart, box });
    group.push(chart);
    chart.hooks.setScale = [
      (u, scale) => {
        if (scale !== "x") return;
        const times = u.data[0];
        reset.hidden = u.scales.x.min <= times[0] && u.scales.x.max >= times[times.length - 1];
      },
    ];
  }
  reset.addEventListener("click", () => {
    for (const chart of group) {
      const times = chart.data[0];
      chart.setScale("x", { min: times[0], max: times[times.length - 1] });
    }
  });
}

function fit() {
  for (const { chart, box } of charts) {
    const size = { width: box.clientWidth, height: box.clientHeight };
    if (size.width !== chart.width || size.height !== chart.height) chart.setSize(size);
  }
}

function repaint() {
  for (const { chart } of charts) chart.redraw(false);
}

const observer = new ResizeObserver(fit);
observer.observe(document.querySelector(".page"));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", repaint);

function printing(on) {
  document.documentElement.classList.toggle("printing", on);
  fit();
  repaint();
}
addEventListener("beforeprint", () => printing(true));
addEventListener("afterprint", () => printing(false));
