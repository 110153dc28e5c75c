
// A picture of a plane: curves that are no functions of x, each with the frequency along it,
// on two linear axes. It is drawn as the SVG that Save gives.

// Multiples of the first step that leaves `space` pixels between two of them.
function splitsOf({ range: [low, high], steps }, pixels, space) {
  const fits = (step) => (pixels * step) / (high - low) >= space;
  const step = steps.find(fits) ?? steps[steps.length - 1];
  const first = Math.ceil(low / step - 1e-9);
  const count = Math.floor(high / step + 1e-9) - first + 1;
  const splits = Array.from({ length: count }, (_, i) => (first + i) * step);
  return { _splits: splits, _values: ticks(null, splits, null, space, step) };
}

// The same length of a unit on both axes, around the middle of what is to be seen.
function squared(x, y, width, height) {
  const span = ({ range: [low, high] }) => high - low;
  const unit = Math.min(width / span(x), height / span(y));
  const around = (axis, pixels) => {
    const middle = (axis.range[0] + axis.range[1]) / 2;
    return { ...axis, range: [middle - pixels / unit / 2, middle + pixels / unit / 2] };
  };
  return [around(x, width), around(y, height)];
}

// What a plane has in place of uPlot's chart, in pixels of a canvas: place, scales, curves.
function planeOf(plot, width, height) {
  const px = devicePixelRatio;
  const [left, top] = [64, 6];
  const [inner, tall] = [Math.max(1, width - left - 14), Math.max(1, height - top - 40)];
  const [x, y] = plot.square ? squared(plot.x, plot.y, inner, tall) : [plot.x, plot.y];
  const share = (value, { range: [low, high] }) => (value - low) / (high - low);
  return {
    width,
    height,
    bbox: { left: left * px, top: top * px, width: inner * px, height: tall * px },
    data: [null, ...plot.curves.map((curve) => [curve.x, curve.y])],
    axes: [
      { label: x.label, ...splitsOf(x, inner, 44) },
      { label: y.label, ...splitsOf(y, tall, 24) },
    ],
    valToPos: (value, scale) =>
      scale === "x" ? px * (left + inner * share(value, x)) : px * (top + tall * (1 - share(value, y))),
  };
}

// The place on a curve at a frequency; none outside of it.
function placeAt({ f, x, y }, frequency) {
  if (!f || frequency == null) return null;
  const place = [x, y].map((values) => valueAt(f, values, frequency));
  return place.includes(null) ? null : place;
}

// The frequency of the point of a curve that is nearest to a place in pixels of the canvas, none
// beyond `reach`.
function nearest({ chart, plot }, px, py, reach) {
  let [found, least] = [null, reach];
  plot.curves.forEach(({ f, x, y }, i) => {
    if (!f || !chart.series[i + 1].show) return;
    f.forEach((frequency, k) => {
      const distance = Math.hypot(chart.valToPos(x[k], "x") - px, chart.valToPos(y[k], "y") - py);
      if (distance < least) [found, least] = [frequency, distance];
    });
  });
  return found;
}

// Marks on the visible curves: the cursors and the pointer.
function drawPlaces(u, pen, plot, show) {
  const px = devicePixelRatio;
  const { left, top, width, height } = u.bbox;
  const marks = [["A", plot.over.cursors.A], ["B", plot.over.cursors.B], ["", plot.pointer]];
  plot.curves.forEach((curve, i) => {
    for (const [name, frequency] of marks) {
      const place = show[i + 1].show && placeAt(curve, frequency);
      if (!place) continue;
      const [x, y] = [u.valToPos(place[0], "x"), u.valToPos(place[1], "y")];
      if (x < left || x > left + width || y < top || y > top + height) continue;
      Object.assign(pen, { fillStyle: cssColour(name ? "text" : curve.colour), textAlign: "left", textBaseline: "bottom" });
      pen.fillRect(x - 3 * px, y - 3 * px, 6 * px, 6 * px);
      if (name) pen.fillText(name, x + 5 * px, y - 2 * px);
    }
  });
}

let planes = 0;

// Draws `plot` = { curves: [{ label, f, x, y, colour, … }], x, y: { label, range, steps }, square,
// columns, read } into `figure`; gives a view as other plots have it.
function drawPlane(figure, plot, title) {
  const box = figure.querySelector(".plot");
  const caption = figure.querySelector("figcaption");
  const area = `area-${++planes}`;
  const series = [{}, ...plot.curves.map(() => ({ show: true }))];
  const view = { figure, box, plot, title };
  view.chart = {
    redraw: () => (box.innerHTML = svgOf(view, true)),
    setSize({ width, height }) {
      Object.assign(view.chart, planeOf(plot, width, height));
      view.chart.redraw();
    },
    series,
    area,
  };
  const value = () => element("td", { className: "u-value" });
  const frequency = value();
  const values = plot.curves.map(value);
  const rows = plot.curves.map(({ f, label }, i) => {
    const name = element(
      "th", { tabIndex: 0, title: "show or hide" },
      element("div", { className: "u-marker" }), element("div", { className: "u-label", textContent: label }),
    );
    name.setAttribute("role", "button");
    const row = element("tr", { className: "u-series" }, name, ...(f ? [values[i]] : []));
    const turn = () => {
      const show = (series[i + 1].show = !series[i + 1].show);
      row.classList.toggle("u-off", !show);
      name.setAttribute("aria-pressed", show);
      view.chart.redraw();
    };
    name.setAttribute("aria-pressed", true);
    name.addEventListener("click", turn);
    name.addEventListener("keydown", (event) => {
      if (event.key !== "Enter" && event.key !== " ") return;
      event.preventDefault();
      turn();
    });
    return row;
  });
  const head = element("tr", { className: "u-series" }, element("th", { textContent: plot.over.name ?? "f" }), frequency);
  const legend = element("table", { className: "u-legend u-inline u-live" }, element("tbody", {}, head, ...rows));
  caption.append(legend);
  colourMarkers(caption, plot.curves);
  view.point = (f) => {
    if (plot.pointer === f) return;
    plot.pointer = f;
    caption.classList.toggle("reading", f != null);
    frequency.textContent = f == null ? MISSING : plot.over.at(f);
    plot.curves.forEach((curve, i) => {
      const place = placeAt(curve, f);
      values[i].textContent = place ? plot.read(...place) : MISSING;
    });
    view.chart.redraw();
  };
  view.chart.setSize({ width: box.clientWidth, height: box.clientHeight });
  return view;
}

// The pointer over a plane is that of the plots over frequency, and theirs is its.
function joinPlanes(charts, planes) {
  if (!charts.length) return;
  const [{ chart }] = charts;
  const point = (u) => {
    const f = u.cursor.idx == null ? null : u.data[0][u.cursor.idx];
    planes.forEach((plane) => plane.point(f));
  };
  chart.hooks.setCursor = [...(chart.hooks.setCursor ?? []), point];
  for (const plane of planes) {
    const at = (event) => {
      const { left, top } = plane.box.getBoundingClientRect();
      const px = devicePixelRatio;
      return nearest(plane, (event.clientX - left) * px, (event.clientY - top) * px, 40 * px);
    };
    const show = (f) => chart.setCursor(f == null ? { left: -10, top: -10 } : { left: chart.valToPos(f, "x"), top: 1 });
    plane.box.addEventListener("pointermove", (event) => show(at(event)));
    plane.box.addEventListener("pointerleave", () => show(null));
    plane.box.addEventListener("click", (event) => {
      const f = at(event);
      if (f != null) setCursor(charts[0], event.shiftKey, f);
    });
  }
}
