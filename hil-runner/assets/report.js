// Which plots the page has, and what they do together.

import { drawChart, element, extent, FREQUENCY, reading, TIME } from "./chart.js";
import { aligned } from "./curves.js";
import { followKeys, followPointer, showCursors } from "./cursors.js";
import { followFront, frontPlot } from "./front.js";
import { loopPlots, loopsOf } from "./loops.js";
import { drawPlane, joinPlanes } from "./plane.js";
import { casePlots, curveOf, looks, overPlot, QUANTITIES, TRACE_OF } from "./plots.js";
import { saveMenu } from "./save.js";
import { followWindow, views } from "./views.js";

const data = JSON.parse(document.getElementById("plot-data").textContent);

// Runs that can be laid over each other: the cases, or the rungs of the ladder.
const runsOf = { cases: () => data.cases, ladder: () => data.ladder.rungs };

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

// Two runs of a case over each other.
function comparePlot(name) {
  const [before, after] = data.cases.map(({ traces }) => traces[TRACE_OF[name] ?? "t_s"] && casePlots[name](traces));
  return overPlot(before, after, ["before", "after"], data.compare.one_command);
}

const runsFor = ({ dataset }) => (dataset.of === "compare" ? data.cases : [data.cases[+dataset.case]]);

const tuneData = () => JSON.parse(document.getElementById("tune-data").textContent);

function plotFor(figure) {
  const { plot, of, column, case: index, rung } = figure.dataset;
  if (loopPlots[plot]) return { over: FREQUENCY, ...loopPlots[plot](loopsOf(runsFor(figure))) };
  if (plot === "front") return frontPlot(tuneData());
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
    if (figure.dataset.plot === "front") {
      const rows = [...section.querySelectorAll("tbody tr")].filter((row) => !figure.contains(row));
      followFront(view, rows, tuneData().sets);
    }
    (plane ? planes : own).push(view);
    if (!plane) followKeys(view);
  }
  views.push(...own, ...planes);
  joinPlanes(own, planes);
  section.querySelector("button.reset").addEventListener("click", () => {
    for (const { chart } of own) chart.setScale("x", whole(chart));
  });
}

followWindow(document.querySelector(".page"));
