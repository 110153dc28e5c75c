// @ts-check
// The page of a study: draws its pictures from their specifications, and lets a reader ask a
// mark for its runs. A run is opened by the event "open-row", which a simulator may hear.

import { bytesOf, enter, unpacked } from "./packed.js";

/**
 * @typedef {{ name: string, label: string, unit: string, value?: any, values?: any[] }} Column
 * @typedef {{ key: string, value?: string, values?: (string | null)[], planes?: string }} SetColumn
 * @typedef {{ study: string, base: string, rows: number, of: number, digits: number, axes: string[],
 *   sets: SetColumn[], columns: Column[] }} Rows
 * @typedef {{ file: string, specification: any }} Picture
 * @typedef {{ row: number, sets: string[], figures: Record<string, any> }} OpenRow
 */

/** @type {any} */
const page = globalThis;

/**
 * @template {keyof HTMLElementTagNameMap} T
 * @param {T} name
 * @param {Record<string, any>} [properties]
 * @param {(Node | string)[]} children
 * @returns {HTMLElementTagNameMap[T]}
 */
function node(name, properties = {}, ...children) {
  const made = Object.assign(document.createElement(name), properties);
  made.append(...children);
  return made;
}

/**
 * Numbers, exactly, whose first bytes come first, then all second ones, and so on.
 * @param {string} planes
 * @param {number} count
 */
function numbers(planes, count) {
  const bytes = bytesOf(planes);
  const view = new DataView(new ArrayBuffer(8));
  return Array.from({ length: count }, (_, row) => {
    for (let plane = 0; plane < 8; plane++) view.setUint8(plane, bytes[plane * count + row]);
    return String(view.getFloat64(0, true));
  });
}

/** The rows of the page. */
class RowTable {
  /** @param {Rows} rows */
  constructor(rows) {
    this.rows = rows;
    for (const set of rows.sets) if (set.planes) set.values = numbers(set.planes, rows.rows);
    this.sets = new Map(rows.sets.map((set) => [set.key, set]));
  }

  /** @param {number} row */
  has(row) {
    return row < this.rows.rows;
  }

  /**
   * A value of a row; that of an axis stands in its set.
   * @param {Column} column
   * @param {number} row
   */
  value(column, row) {
    if (column.values) return column.values[row];
    if ("value" in column) return column.value;
    const set = this.sets.get(column.name);
    return set ? Number(set.values ? set.values[row] : set.value) : null;
  }

  /**
   * The run of a row, as the event "open-row" tells it.
   * @param {number} row
   * @returns {OpenRow}
   */
  run(row) {
    const sets = this.rows.sets.map(({ key, value, values }) => [key, values ? values[row] : value]);
    const figures = this.rows.columns.map((column) => [column.name, this.value(column, row)]);
    return {
      row,
      sets: sets.filter(([, value]) => value != null).map(([key, value]) => `${key}=${value}`),
      figures: Object.fromEntries(figures.filter(([, value]) => value != null)),
    };
  }

  /** @param {string} name */
  column(name) {
    return this.rows.columns.find((column) => column.name === name);
  }
}

/** @param {any} value */
function shown(value) {
  if (value == null) return "–";
  if (typeof value !== "number") return String(value);
  return String(Number(value.toPrecision(5))).replace("-", "−");
}

/** @param {Column} column */
const titled = ({ label, unit }) => (unit ? `${label} [${unit}]` : label);

/** @param {string} text */
const quoted = (text) => (/^[\w.,=+/-]+$/.test(text) ? text : `'${text.replace(/'/g, `'\\''`)}'`);

/**
 * Lines of at most so many letters.
 * @param {string} text
 * @param {number} most
 */
function folded(text, most) {
  /** @type {string[]} */
  const lines = [];
  for (const word of text.split(" ")) {
    const last = lines.at(-1);
    if (last && last.length + 1 + word.length <= most) lines[lines.length - 1] = `${last} ${word}`;
    else lines.push(word);
  }
  return lines;
}

/** Width beside a plot that its numbers and titles take, and letters of a pixel. */
const BESIDE = 96;
const LETTERS = { title: 1 / 8.6, note: 1 / 5.9, legend: 1 / 7 };

/**
 * A specification for a place of that width; beyond that of its own it does not grow.
 * @param {any} specification
 * @param {number} width
 */
function fitted(specification, width) {
  const spec = structuredClone(specification);
  const views = spec.vconcat ?? [spec];
  const own = views[0].width;
  const text = JSON.stringify(spec.vconcat ?? spec.layer);
  // A scale of colours beside the plot takes room, and names of bars do.
  const beside = BESIDE + (text.includes('"gradientLength"') ? 90 : text.includes('"yOffset"') || text.includes('"category"') ? 110 : 0);
  const plot = Math.max(180, Math.min(own, width - beside));
  for (const view of views) view.width = plot;
  if (plot < own) {
    const narrow = Math.min(plot + 60, width - beside + 10);
    spec.title.text = folded([spec.title.text].flat().join(" "), Math.floor(narrow * LETTERS.title));
    spec.title.subtitle = spec.title.subtitle.flatMap((/** @type {string} */ line) => folded(line, Math.floor(narrow * LETTERS.note)));
  }
  if (plot < 0.8 * own) {
    spec.config.legend.labelLimit = width - 110;
    spec.config.legend.titleOrient = "top";
    spec.config.axis.labelOverlap = true;
    const one = JSON.stringify(spec.layer ?? spec.vconcat).replace(/"columns":\d+/g, '"columns":1');
    spec[spec.layer ? "layer" : "vconcat"] = JSON.parse(one);
    // Crosses of cells are smaller, as the cells are.
    for (const { mark, data } of spec.layer ?? []) if (data?.values?.[0]?.light !== undefined) mark.size *= plot / own;
  }
  return spec;
}

/** A picture in its figure. */
class Drawn {
  /**
   * @param {Picture} picture
   * @param {HTMLElement} figure
   * @param {Study} study
   */
  constructor({ file, specification }, figure, study) {
    this.file = file;
    this.specification = specification;
    this.figure = figure;
    this.study = study;
    this.place = /** @type {HTMLElement} */ (figure.querySelector(".drawing"));
    this.width = 0;
    figure.classList.toggle("map", JSON.stringify(specification).includes('"scheme"'));
    /** @type {any} */
    this.view = null;
  }

  async draw() {
    const width = this.place.clientWidth;
    if (width === this.width) return;
    this.width = width;
    const { vega, vegaLite } = page;
    const lite = fitted(this.specification, width);
    const { spec } = vegaLite.compile(lite, { logger: vega.logger(vega.Error) });
    const runtime = vega.parse(spec, undefined, { ast: true });
    const options = { expr: vega.expressionInterpreter, renderer: "svg", logLevel: vega.Error, hover: false };
    this.view?.finalize();
    const view = new vega.View(runtime, options).initialize(this.place);
    this.view = view;
    view.tooltip((/** @type {any} */ _, /** @type {MouseEvent} */ event, /** @type {any} */ item) => this.study.hover(event, this.rowsOf(item)));
    view.addEventListener("click", (/** @type {any} */ event, /** @type {any} */ item) => {
      const rows = this.rowsOf(item);
      if (rows.length) this.study.choose(this.figure, rows);
    });
    await view.runAsync();
    for (const name of Object.keys(this.specification.datasets)) this.listen(view, name);
  }

  /**
   * The runs of a mark, by their value.
   * @param {any} item
   * @returns {number[]}
   */
  rowsOf(item) {
    return item?.datum?.rows ?? [];
  }

  /**
   * Brushes filter the table.
   * @param {any} view
   * @param {string} name
   */
  listen(view, name) {
    const marks = this.specification.datasets[name];
    const brush = name.replace("runs", "brush");
    try {
      view.addSignalListener(brush, (/** @type {string} */ _, /** @type {Record<string, any[]>} */ ends) => this.brushed(marks, ends));
    } catch {
      // A plot without marks has no brush.
    }
  }

  /**
   * @param {any[]} marks
   * @param {Record<string, any[]>} ends
   */
  brushed(marks, ends) {
    const fields = Object.entries(ends ?? {}).filter(([, range]) => range?.length);
    const inside = (/** @type {any} */ mark) =>
      fields.every(([field, range]) => {
        const value = mark[field];
        if (typeof value !== "number") return range.includes(value);
        const other = mark[`${field}2`] ?? value;
        const [low, high] = [Math.min(...range), Math.max(...range)];
        return Math.min(value, other) <= high && low <= Math.max(value, other);
      });
    const rows = fields.length ? new Set(marks.filter(inside).flatMap((mark) => mark.rows ?? [])) : null;
    this.study.filter(rows && [...rows].sort((a, b) => a - b), this.figure);
  }

  /** @param {"svg" | "png"} format */
  async save(format) {
    const blob =
      format === "svg"
        ? new Blob([await this.view.toSVG()], { type: "image/svg+xml" })
        : await new Promise(async (done) => (await this.view.toCanvas(2)).toBlob(done, "image/png"));
    const href = URL.createObjectURL(blob);
    node("a", { href, download: `${this.file}.${format}` }).click();
    setTimeout(() => URL.revokeObjectURL(href), 60000);
  }
}

/** Rows of the table that are shown at a time. */
const ROWS_SHOWN = 25;

/** The page. */
class Study {
  /**
   * @param {Rows} rows
   * @param {Picture[]} pictures
   */
  constructor(rows, pictures) {
    this.table = new RowTable(rows);
    this.tip = node("div", { className: "tip", hidden: true });
    this.panel = node("div", { className: "run", hidden: true, id: "run" });
    this.panel.setAttribute("role", "region");
    this.panel.setAttribute("aria-live", "polite");
    document.body.append(this.tip);
    // What it says is no longer below the pointer.
    addEventListener("scroll", () => (this.tip.hidden = true), { passive: true });
    this.drawn = pictures.map((picture) => {
      const figure = /** @type {HTMLElement} */ (document.getElementById(picture.file));
      return new Drawn(picture, figure, this);
    });
    this.columns = this.shownColumns(pictures);
    this.filter(null);
  }

  /**
   * Columns of the table: axes, verdict, and what the pictures show.
   * @param {Picture[]} pictures
   */
  shownColumns(pictures) {
    const { axes, columns } = this.table.rows;
    const words = JSON.stringify(pictures.map(({ specification: { vconcat, layer } }) => vconcat ?? layer));
    const named = (/** @type {Column} */ { name, label }) => axes.includes(name) || ["rung", "status", "pass"].includes(name) || words.includes(label);
    return columns.filter((column) => named(column) && !("value" in column));
  }

  /**
   * Says what a mark stands for, at the pointer.
   * @param {MouseEvent} event
   * @param {number[]} rows
   */
  hover(event, rows) {
    this.tip.hidden = !rows.length;
    if (!rows.length) return;
    const row = rows[(rows.length - 1) >> 1];
    const name = rows.length > 1 ? `${rows.length} runs, in the middle row ${row}` : `row ${row}`;
    const values = this.table.has(row) ? this.columns : [];
    this.tip.replaceChildren(
      node("b", {}, name),
      ...values.map((column) => node("div", {}, `${titled(column)}: ${shown(this.table.value(column, row))}`)),
    );
    const { clientWidth, clientHeight } = document.documentElement;
    const { offsetWidth, offsetHeight } = this.tip;
    const left = event.clientX + 14 + offsetWidth > clientWidth ? event.clientX - offsetWidth - 10 : event.clientX + 14;
    const top = Math.min(event.clientY + 14, clientHeight - offsetHeight - 4);
    Object.assign(this.tip.style, { left: `${Math.max(2, left)}px`, top: `${Math.max(2, top)}px` });
  }

  /**
   * Opens the run in the middle of those of a mark, with a choice of the others.
   * @param {HTMLElement} place
   * @param {number[]} rows
   */
  choose(place, rows) {
    this.place = place;
    this.others = rows;
    this.open(rows[(rows.length - 1) >> 1]);
  }

  /**
   * Shows a row below the picture, and tells who listens.
   * @param {number} row
   */
  open(row) {
    const { study, of } = this.table.rows;
    const head = node("h3", {}, `Row ${row}`);
    this.panel.replaceChildren(head, ...this.choice(row));
    if (this.table.has(row)) {
      const run = this.table.run(row);
      const line = run.sets.map((set) => `--set ${quoted(set)}`).join(" ");
      const values = this.table.rows.columns.filter(({ name }) => run.figures[name] !== undefined);
      const cells = values.map((column) =>
        node("tr", {}, node("th", { scope: "row" }, column.label), node("td", { className: "n" }, shown(run.figures[column.name])), node("td", {}, column.unit)),
      );
      this.panel.append(
        node("pre", {}, node("code", {}, line)),
        node("div", { className: "scroll", tabIndex: 0 }, node("table", { className: "figures" }, node("tbody", {}, ...cells))),
      );
      (this.place ?? this.section).after(this.panel);
      this.panel.hidden = false;
      document.dispatchEvent(new CustomEvent("open-row", { detail: run }));
    } else {
      this.panel.append(node("p", {}, `This page carries the first ${this.table.rows.rows} of ${of} rows. hil-runner study FOLDER --row ${row} makes this one, of the folder of the results of ${study}.`));
      (this.place ?? this.section).after(this.panel);
      this.panel.hidden = false;
    }
  }

  /**
   * Buttons for the runs that share a mark, the least first.
   * @param {number} row
   */
  choice(row) {
    const rows = this.others ?? [row];
    if (rows.length < 2) return [];
    const at = rows.indexOf(row);
    const to = (/** @type {number} */ place, /** @type {string} */ words) => {
      const button = node("button", { type: "button", disabled: place === at }, `${words}: row ${rows[place]}`);
      button.addEventListener("click", () => this.open(rows[place]));
      return button;
    };
    const choices = [to(0, "least"), to((rows.length - 1) >> 1, "middle"), to(rows.length - 1, "most")];
    const next = at < 0 || at + 1 === rows.length ? [] : [to(at + 1, "next")];
    return [node("p", { className: "choice" }, `${rows.length} runs share this mark. `, ...choices, ...next)];
  }

  /**
   * Fills the table with these rows, or with all.
   * @param {number[] | null} rows
   * @param {HTMLElement} [figure]
   */
  filter(rows, figure) {
    const all = rows ?? Array.from({ length: this.table.rows.rows }, (_, row) => row);
    this.section.hidden = false;
    const words = rows
      ? `${all.length} of ${this.table.rows.of} rows, brushed in ${figure?.querySelector("figcaption b")?.textContent ?? "a figure"}`
      : `${all.length} rows`;
    const said = /** @type {HTMLElement} */ (this.section.querySelector(".said"));
    said.replaceChildren(words.replace(/\.$/, ""), ". ");
    if (rows) {
      const button = node("button", { type: "button" }, "Show all");
      button.addEventListener("click", () => this.filter(null));
      said.append(button);
    }
    const head = node("tr", {}, node("th", { scope: "col" }, "Row"), ...this.columns.map((column) => node("th", { scope: "col" }, titled(column))));
    const body = node("tbody");
    const more = node("button", { type: "button" }, "More rows");
    let at = 0;
    const fill = () => {
      const next = all.slice(at, at + ROWS_SHOWN).filter((row) => this.table.has(row));
      at += ROWS_SHOWN;
      body.append(...next.map((row) => this.line(row)));
      more.hidden = at >= all.length;
    };
    more.addEventListener("click", fill);
    fill();
    const table = node("table", { className: "figures" }, node("thead", {}, head), body);
    this.section.querySelector(".rows")?.replaceChildren(table, more);
  }

  /** @param {number} row */
  line(row) {
    const button = node("button", { type: "button", title: "Open this run" }, String(row));
    button.addEventListener("click", () => {
      this.place = undefined;
      this.others = [row];
      this.open(row);
    });
    const cells = this.columns.map((column) => {
      const value = this.table.value(column, row);
      return node("td", { className: typeof value === "number" ? "n" : "" }, shown(value));
    });
    return node("tr", {}, node("th", { scope: "row" }, button), ...cells);
  }

  get section() {
    return /** @type {HTMLElement} */ (document.getElementById("rows"));
  }
}

async function start() {
  document.documentElement.classList.add("drawing");
  const [libraries, data] = await Promise.all(["libraries", "data"].map(async (name) => (await unpacked(name)).text()));
  enter(libraries);
  const { rows, pictures } = JSON.parse(data);
  const study = new Study(rows, pictures);
  const { dataset } = document.documentElement;
  for (const drawn of study.drawn) {
    await drawn.draw();
    for (const button of drawn.figure.querySelectorAll("button")) {
      button.addEventListener("click", () => drawn.save(/** @type {"svg" | "png"} */ (button.dataset.save)));
    }
    // The first picture answers while the others are drawn.
    dataset.ready ??= String(Math.round(performance.now()));
    await new Promise((next) => setTimeout(next));
  }
  dataset.drawn = String(Math.round(performance.now()));
  let waiting = 0;
  addEventListener("resize", () => {
    clearTimeout(waiting);
    waiting = setTimeout(async () => {
      for (const drawn of study.drawn) await drawn.draw();
    }, 200);
  });
}

start().catch((error) => {
  const sentence = `The pictures cannot be drawn here (${error.message}); the tables hold nonetheless.`;
  document.querySelector("#pictures h2")?.after(node("p", { className: "note" }, sentence));
});
