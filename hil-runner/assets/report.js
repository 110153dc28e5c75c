
// Which plots there are, what each shows, and what they do together.

const data = JSON.parse(document.getElementById("plot-data").textContent);
const ACCELERATION = "acceleration [m/s²]";

// Columns of a run, in the order of the choice of quantities: words and unit.
const QUANTITIES = {
  acc_mps2: ["carriage acceleration", "m/s²"],
  acc_ref_mps2: ["acceleration command", "m/s²"],
  x_m: ["carriage position", "m"],
  x_ref_m: ["position command", "m"],
  v_mps: ["carriage velocity", "m/s"],
  v_ref_mps: ["velocity command", "m/s"],
  following_error_mm: ["following error x_ref − x", "mm"],
  current_a: ["armature current", "A"],
  motor_voltage_v: ["motor voltage", "V"],
  dac_code: ["DAC code", ""],
  gap_deg: ["joint gap ε", "°"],
};

// A column of a run as a curve.
function curveOf(traces, column, look) {
  const [label, unit] = QUANTITIES[column];
  const held = column === "dac_code" || (column === "motor_voltage_v" && traces.voltage_held);
  return { t: traces.t_s, y: traces[column], column, label, unit, held, colour: "c-plain", ...look };
}
const command = (traces, column) =>
  curveOf(traces, column, { label: "command", colour: "c-command", dash: [6, 4] });
const carriage = (traces, column) =>
  curveOf(traces, column, { label: "carriage", colour: "c-carriage" });

// Command and carriage of one case: the same vertical scale, else the eye
// compares shapes that are not comparable.
const accelerationRange = (traces) => extent(traces.acc_ref_mps2, traces.acc_mps2);

// A limit far outside the picture would flatten the curve; it is named in the
// caption instead. 30 % is where the curve still has a third of the height.
const LIMIT_IN_SIGHT = 0.3;

const casePlots = {
  command: (traces) => ({
    curves: [{ ...command(traces, "acc_ref_mps2"), colour: "text", dash: undefined }],
    yLabel: ACCELERATION,
    include: accelerationRange(traces),
  }),
  carriage: (traces) => ({
    curves: [carriage(traces, "acc_mps2")],
    yLabel: ACCELERATION,
    include: accelerationRange(traces),
  }),
  acceleration: (traces) => ({
    curves: [command(traces, "acc_ref_mps2"), carriage(traces, "acc_mps2")],
    yLabel: ACCELERATION,
    marks: traces.impacts_s,
  }),
  position: (traces) => ({
    curves: [command(traces, "x_ref_m"), carriage(traces, "x_m")],
    yLabel: "position [m]",
  }),
  velocity: (traces) => ({
    curves: [command(traces, "v_ref_mps"), carriage(traces, "v_mps")],
    yLabel: "velocity [m/s]",
  }),
  following_error: (traces) => ({
    curves: [curveOf(traces, "following_error_mm", { label: "error" })],
    yLabel: "x_ref − x [mm]",
    include: [0],
  }),
  voltage: voltagePlot,
  current: (traces) => ({
    curves: [curveOf(traces, "current_a", { label: "current" })],
    yLabel: "current [A]",
    include: [0],
  }),
  code: codePlot,
  gap: gapPlot,
};

function voltagePlot(traces) {
  const limit = traces.voltage_limit_v;
  const plot = {
    curves: [curveOf(traces, "motor_voltage_v", { label: "voltage" })],
    yLabel: "voltage [V]",
    include: [0],
  };
  if (limit === null) return plot;
  plot.include = [-limit, limit];
  plot.limits = [
    { value: limit, label: `+V_max = ${limit} V`, below: true },
    { value: -limit, label: `−V_max = −${limit} V` },
  ];
  return plot;
}

function codePlot(traces) {
  const plot = {
    curves: [curveOf(traces, "dac_code", { label: "code" })],
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
    plot.key = minus(`range ${low} … ${high}, at most ${Math.ceil(100 * used)} % used`);
  }
  return plot;
}

// The play as a grey band; contact +1 is shaded above it and −1 below it,
// where the joint then is, so that colour is not the only sign.
function gapPlot(traces) {
  const b = traces.backlash_half_deg;
  const curves = [curveOf(traces, "gap_deg", { label: "ε" })];
  const plot = { curves, yLabel: "gap ε [°]", include: [0] };
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

// Runs that can be laid over each other: the cases, or the rungs of the ladder.
const runsOf = { cases: () => data.cases, ladder: () => data.ladder.rungs };
const RUN_COLOURS = ["c-rung-3", "c-vermilion", "c-rung-2", "c-rung-4", "c-command"];

// The lowest rung is broad and pale and every next one thinner, so that
// curves that coincide can still be seen to do so. Cases have one width, and
// dashes where the colours begin again.
const looks = {
  cases: (i) => ({
    colour: RUN_COLOURS[i % RUN_COLOURS.length],
    dash: [undefined, [8, 3], [4, 4]][Math.floor(i / RUN_COLOURS.length) % 3],
  }),
  ladder: (i) => ({ colour: `c-rung-${Math.min(i, 4)}`, width: Math.max(1, 5 - 1.2 * i) }),
};

// One quantity of all runs.
function overlayPlot(of, column) {
  const curves = [];
  runsOf[of]().forEach(({ name, traces }, i) => {
    if (!traces[column]) return;
    curves.push(curveOf(traces, column, { label: name, of: name, ...looks[of](i) }));
  });
  const [label, unit] = QUANTITIES[column];
  return { curves, yLabel: unit ? `${label} [${unit}]` : label };
}

// The measured log over the curves of the same columns, within their time.
function withLog(plot) {
  const logged = (data.log?.columns ?? []).filter(({ name }) =>
    plot.curves.some(({ column }) => column === name),
  );
  const ends = plot.curves.flatMap(({ t }) => [t[0], t[t.length - 1]]);
  const inTime = (_, i) => data.log.t_s[i] >= Math.min(...ends) && data.log.t_s[i] <= Math.max(...ends);
  const t = logged.length ? data.log.t_s.filter(inTime) : [];
  const measured = logged.map(({ name, values }) => {
    const over = plot.curves.filter(({ column }) => column === name);
    const label = logged.length > 1 ? `${over[0].label}, measured` : "measured";
    const { unit } = over[0];
    return {
      t, y: values.filter(inTime), column: name, of: "measured", label, unit, colour: "text", dash: [2, 3],
    };
  });
  return { ...plot, ...aligned([...plot.curves, ...measured]) };
}

function differencePlot(rung, column, label, unit) {
  const y = data.ladder.rungs[rung][column];
  if (!y) return null;
  const look = { colour: `c-rung-${Math.min(rung, 4)}`, width: 1.2 };
  const curves = [{ t: data.ladder.t_s, y, column, label: "difference", unit, ...look }];
  return { curves, yLabel: `${label} [${unit}]`, include: [0] };
}

// Two runs of a case over each other: the plot of each with the curves of both.
function comparePlot(name) {
  const [before, after] = data.cases.map(({ traces }) => traces[TRACE_OF[name] ?? "t_s"] && casePlots[name](traces));
  if (!before || !after) return before || after;
  const named = (plot, word, look) =>
    plot.curves
      .filter(({ label }) => label !== "command" || !data.compare.one_command || word === "after")
      .map((curve) => {
        const command = curve.label === "command";
        const label = plot.curves.length === 1 ? word : command && data.compare.one_command ? "command" : `${curve.label} ${word}`;
        return { ...curve, of: word, label, ...(command ? { dash: word === "before" ? [2, 3] : [6, 4] } : look) };
      });
  return {
    ...before,
    ...after,
    key: after.key && `after: ${after.key}`,
    include: [...(before.include ?? []), ...(after.include ?? [])],
    curves: [
      ...named(before, "before", { colour: "c-rung-4", dash: [6, 4] }),
      ...named(after, "after", { colour: "c-carriage", dash: undefined }),
    ],
  };
}
// Columns without which there is no such plot.
const TRACE_OF = { code: "dac_code", gap: "gap_deg" };

const runsFor = ({ dataset }) => (dataset.of === "compare" ? data.cases : [data.cases[+dataset.case]]);

function plotFor(figure) {
  const { plot, of, column, case: index, rung } = figure.dataset;
  if (loopPlots[plot]) return { over: FREQUENCY, ...loopPlots[plot](loopsOf(runsFor(figure))) };
  if (plot === "front") return frontPlot(JSON.parse(document.getElementById("tune-data").textContent));
  if (of === "compare") return comparePlot(plot);
  if (plot === "overlay") return overlayPlot(of, column);
  if (plot === "acc_diff") return differencePlot(+rung, "acc_diff_mps2", "Δẍ", "m/s²");
  if (plot === "pos_diff") return differencePlot(+rung, "pos_diff_um", "Δx", "µm");
  return casePlots[plot](data.cases[+index].traces);
}

// In place of a plot that would be empty or a line along zero.
function noteInstead(figure, text) {
  figure.querySelector(".plot").replaceWith(element("p", { className: "plot-note", textContent: text }));
}

const nameOf = (box) => (box.dataset.name ??= box.getAttribute("aria-label"));
const titleOf = (name) => name.replace(/ \[.*| over (time|frequency).*/, "");

// All plots of the page: { figure, box, chart, plot, title }.
const views = [];

// Draws the plot of a figure, in place of what `view` has shown before.
function draw(figure, section, view) {
  const plan = plotFor(figure);
  if (!plan?.curves.length || plan.curves[0].t.length < 2) {
    return noteInstead(figure, plan?.missing ?? "No curve recorded.");
  }
  if (figure.dataset.rung && extent(plan.curves[0].y).every((v) => v === 0)) {
    return noteInstead(figure, "The same in every row.");
  }
  const plot = withLog({ over: TIME, ...plan });
  const box = figure.querySelector(".plot");
  const chart = drawChart(figure, plot, section.dataset.group);
  if (plot.key) figure.querySelector("figcaption").append(element("span", { className: "key", textContent: plot.key }));
  const name = nameOf(box).replace("{quantity}", plot.yLabel);
  const [low, high] = extent(...plot.curves.map((curve) => curve.y));
  box.setAttribute("aria-label", `${name}; from ${reading(low)} to ${reading(high)}`);
  const title = titleOf(name);
  chart.hooks.setScale = [(u, scale) => scale === "x" && tellZoom(section, u)];
  view = Object.assign(view ?? { figure, box }, { chart, plot, title });
  chart.hooks.draw.push(() => showCursors(view));
  followPointer(view);
  return view;
}

const whole = ({ data: [times] }) => ({ min: times[0], max: times[times.length - 1] });

function tellZoom(section, { data: [times], scales }) {
  const zoomed = scales.x.min > times[0] || scales.x.max < times[times.length - 1];
  section.querySelector("button.reset").hidden = !zoomed;
}

// The choice of the quantity that an overlay shows; the zoom stays.
function choice(view, section) {
  const { figure } = view;
  const runs = runsOf[figure.dataset.of]();
  const has = (column) => runs.some(({ traces }) => traces[column]);
  const options = Object.keys(QUANTITIES).filter(has).map((column) => {
    const [label, unit] = QUANTITIES[column];
    return element("option", { value: column, textContent: unit ? `${label} [${unit}]` : label });
  });
  const select = element("select", {}, ...options);
  select.addEventListener("change", () => {
    const { min, max } = view.chart.scales.x;
    const shown = view.chart.series.map(({ show }) => show);
    figure.querySelector(".u-legend").remove();
    view.chart.destroy();
    figure.dataset.column = select.value;
    draw(figure, section, view);
    view.chart.setScale("x", { min, max });
    shown.forEach((show, i) => i > 0 && !show && view.chart.series[i] && view.chart.setSeries(i, { show }));
  });
  return element("label", { className: "choice" }, "Quantity ", select);
}

for (const section of document.querySelectorAll("[data-group]")) {
  const [own, planes] = [[], []];
  for (const figure of section.querySelectorAll("figure[data-plot]")) {
    const plane = "plane" in figure.dataset;
    const view = plane
      ? drawPlane(figure, plotFor(figure), titleOf(nameOf(figure.querySelector(".plot"))))
      : draw(figure, section);
    if (!view) continue;
    const caption = figure.querySelector("figcaption");
    if (figure.dataset.plot === "overlay") caption.append(choice(view, section));
    caption.append(saveMenu(view));
    if (figure.dataset.plot === "front") followFront(view, [...section.querySelectorAll("tbody tr")].filter((row) => !figure.contains(row)));
    (plane ? planes : own).push(view);
    if (!plane) followKeys(view);
  }
  views.push(...own, ...planes);
  joinPlanes(own, planes);
  section.querySelector("button.reset").addEventListener("click", () => {
    for (const { chart } of own) chart.setScale("x", whole(chart));
  });
}

function fit() {
  for (const { chart, box } of views) {
    const size = { width: box.clientWidth, height: box.clientHeight };
    if (size.width !== chart.width || size.height !== chart.height) chart.setSize(size);
  }
}

function repaint() {
  for (const { chart } of views) chart.redraw(false);
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
