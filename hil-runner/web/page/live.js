// The live page: controls, simulator, pictures and figures together.

import { element } from "../../assets/chart.js";
import { followWindow } from "../../assets/views.js";
import { Figures } from "./figures.js";
import { Form, plainText } from "./keys.js";
import { GainsMap } from "./map.js";
import { Pictures } from "./pictures.js";
import { commandOf, copy, download, fileBox, setWords } from "./share.js";
import { ASKED, LIVE, MAP, Simulator } from "./simulator.js";
import { fragmentOf, readFragment, State } from "./state.js";

/** @import { Answer } from "./simulator.js" */
/** @import { Case } from "./state.js" */
/** @import { Description, Key } from "./keys.js" */
/** @typedef {{ ownsAddress: boolean, ladder?: boolean, title?: string }} Options */

/** Time without a move after which the controls rest [ms]. */
const REST_MS = 200;
let mounted = 0;

/**
 * Makes the live page in an empty element.
 * @param {HTMLElement} root @param {Case} data @param {Options} options
 */
export function mountLive(root, data, options) {
  document.documentElement.classList.add("js");
  // The image is unpacked while the page is made.
  const loading = Simulator.load();
  const page = new Page(root, data, options);
  const ready = page.start(loading);
  return {
    ready,
    /** Shows a run of the same case. @param {string[]} sets @param {string} title */
    async open(sets, title) {
      await ready;
      root.hidden = false;
      page.state.open(sets.filter((set) => !page.form.hasAlready(set)));
      page.title.textContent = title;
      page.opened = String(page.state.sets);
      const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
      root.scrollIntoView({ behavior: still ? "auto" : "smooth" });
      const run = await page.moved();
      return { figures: run?.figures ?? [], sets: page.state.sets };
    },
  };
}

/** A button with its action. @param {string} textContent @param {(button: HTMLButtonElement) => void} act @param {string} [title] */
function button(textContent, act, title = "") {
  const made = element("button", { type: "button", textContent, title });
  made.addEventListener("click", () => act(made));
  return made;
}

class Page {
  /** @param {HTMLElement} root @param {Case} data @param {Options} options */
  constructor(root, data, options) {
    this.root = root;
    this.data = data;
    this.options = options;
    this.state = new State(data);
    this.ladder = options.ladder ?? false;
    /** @type {Answer | null} the last run without errors, the pinned one, and those of the rungs */
    this.live = null;
    /** @type {Answer | null} */
    this.pinned = null;
    /** @type {Answer[] | null} */
    this.rungs = null;
    this.prefix = `live${mounted++ || ""}`;
    root.classList.add("live", "empty");
    root.classList.toggle("part", !options.ownsAddress);
    this.mark("starting");
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this.timer = undefined;
    this.busy = false;
    /** The sets of the row that was opened, until they change. */
    this.opened = "";
    this.looped = false;
    /** @type {Simulator | null} */
    this.simulator = null;
    /** @type {Description | null} */
    this.description = null;
    this.described = data;
    this.title = element(this.options.ownsAddress ? "h1" : "h2", { textContent: this.options.title ?? data.name });
    this.law = element("small");
    this.told = document.getElementById("told") ?? document.body.appendChild(element("p", { id: "told" }));
    this.told.setAttribute("role", "status");
    const tell = (/** @type {string} */ sentence) => this.tell(sentence);
    this.undo = button("Undo", () => this.step(-1), "Ctrl+Z");
    this.redo = button("Redo", () => this.step(1), "Ctrl+Shift+Z, Ctrl+Y");
    this.pin = button("Pin this run", () => this.setPin(), "keeps this run below the next ones, with differences in every figure");
    this.rungsSwitch = button("Ladder", () => this.setLadder(), "all rungs over each other");
    this.rungsSwitch.setAttribute("aria-pressed", String(this.ladder));
    this.pin.setAttribute("aria-pressed", "false");
    const all = button("Reset all", () => this.change(() => (this.state.now = { ...this.state.now, changes: {} })), "every key as the file has it");
    const bar = element(
      "div", { className: "bar-line tools" }, this.undo, this.redo, all, this.pin, this.rungsSwitch,
      button("Copy as --set", (own) => copy(own, setWords(this.state.sets), tell)),
      button("Copy command", (own) => copy(own, this.command.textContent ?? "", tell)),
      button("Save run file", () => this.save()),
    );
    this.command = element("code");
    this.said = element("p", { className: "said" });
    this.said.setAttribute("aria-live", "polite");
    this.problems = element("ul", { className: "errors note", hidden: true });
    this.problems.setAttribute("role", "alert");
    this.remarks = element("ul", { className: "note remarks", hidden: true });
    this.remarks.setAttribute("role", "status");
    const strip = element("div", { className: "strip" });
    const section = (/** @type {string} */ title) => {
      const made = element("section", {}, element("h2", { textContent: title }));
      made.setAttribute("aria-label", title);
      return made;
    };
    const time = section("Over time");
    const loop = section("Loop");
    const map = section("Map");
    const tables = section("Figures and warnings");
    const form = element("div", { className: "keys" });
    const search = element("input", { type: "search", placeholder: "Search keys, units, meanings" });
    search.setAttribute("aria-label", "Search keys");
    search.addEventListener("input", () => this.form.search(search.value));
    const fold = button("Run file", () => fold.setAttribute("aria-expanded", String(!side.classList.toggle("folded"))));
    fold.className = "fold";
    fold.setAttribute("aria-expanded", "true");
    const side = element("aside", { className: "side" }, fold, search, form, fileBox(this.root, (name, text) => this.openFile(name, text)));
    side.setAttribute("aria-label", "Run file");
    this.root.replaceChildren(
      element("header", { className: "head" }, this.title, this.law, element("p", { className: "command" }, this.command), bar, this.said),
      side,
      element("div", { className: "main" }, this.problems, this.remarks, strip, time, map, loop, tables),
    );
    this.form = new Form(form, {
      given: (path) => this.state.now.changes[path],
      dropped: (key) => this.dropped(key),
      set: (path, value) => this.change(() => this.state.set(path, value)),
    }, this.prefix);
    this.pictures = new Pictures(time, false, `${this.prefix}-time`, () => {});
    this.loops = new Pictures(loop, true, `${this.prefix}-loop`, () => this.live && !this.looped && !this.busy && this.run());
    this.figures = new Figures(strip, tables);
    this.map = new GainsMap(map, this.form, {
      sets: () => this.state.sets,
      run: (sets, lane) => this.ask("simulate", { sets, columns: false, loops: false, confirm: false }, lane),
      stop: () => this.simulator?.drop(MAP),
      pick: (values) => this.change(() => values.forEach(([path, value]) => this.form.put(/** @type {Key} */ (this.form.keys.get(path)), value))),
    });
  }

  /** @param {string} state */
  mark(state) {
    this.root.dataset.state = state;
    if (this.options.ownsAddress) document.documentElement.dataset.state = state;
  }

  /** The key of another way that the page has set, which drops this one of the file. @param {Key} key */
  dropped({ path, value, excludes }) {
    const { changes } = this.state.now;
    if (value == null || changes[path] != null) return undefined;
    return excludes.find((other) => changes[other] != null);
  }

  /** @param {string} sentence */
  tell(sentence) {
    this.said.textContent = sentence;
  }

  /** @param {string} method @param {object} request @param {number} lane @param {Case} [base] */
  async ask(method, request, lane, base = this.state.now.base) {
    const { file, text, beside } = base;
    return this.simulator?.ask(method, { name: file, text, ...(beside && { beside }), sets: this.state.sets, ...request }, lane) ?? null;
  }

  /** @param {Promise<Simulator>} loading */
  async start(loading) {
    try {
      this.simulator = await loading;
    } catch (error) {
      this.mark("refused");
      return this.problem([{ key: null, sentence: `The browser does not run the simulator (${error}). It needs WebAssembly, workers and DecompressionStream, which browsers since 2023 have; “hil-runner run” gives the same figures.` }]);
    }
    await this.describe();
    if (this.options.ownsAddress) {
      this.follow();
      addEventListener("hashchange", () => this.follow() && this.moved());
    }
    this.listen();
    await this.moved();
    if (this.root.dataset.state === "starting") this.mark("ready");
  }

  listen() {
    const target = this.options.ownsAddress ? document : this.root;
    target.addEventListener("keydown", (event) => {
      const { key, ctrlKey, metaKey, shiftKey, target: at } = /** @type {KeyboardEvent} */ (event);
      // A text box undoes its own letters.
      const letters = at instanceof HTMLTextAreaElement || (at instanceof HTMLInputElement && at.type === "search");
      const way = key.toLowerCase() === "y" || (key.toLowerCase() === "z" && shiftKey) ? 1 : key.toLowerCase() === "z" ? -1 : 0;
      if (!(ctrlKey || metaKey) || !way || letters) return;
      event.preventDefault();
      this.step(/** @type {1 | -1} */ (way));
    });
    followWindow(this.root);
    addEventListener("beforeprint", () => {
      this.pictures.draw(true);
      this.loops.draw(true);
    });
  }

  /** Reads a file's keys; false where the file has errors, which are shown. @param {Case} base */
  async describe(base = this.state.now.base) {
    const answer = await this.ask("describe", { sets: base.sets }, ASKED, base);
    if (!answer) return false;
    if (answer.errors) return this.problem(answer.errors), false;
    const description = /** @type {Description} */ (/** @type {unknown} */ (answer));
    this.description = description;
    this.state.excludes = Object.fromEntries(description.sections.flatMap(({ keys }) => keys.map(({ path, excludes }) => [path, excludes])));
    this.form.describe(description);
    this.map.clear();
    this.described = base;
    this.title.textContent = base === this.data ? (this.options.title ?? base.name) : base.name;
    this.list(this.remarks, base === this.data ? [] : ["This file is no part of the page: an address holds only what was changed. Save the file to keep it."]);
    return true;
  }

  /** Takes over what the address says; true if that is another run. */
  follow() {
    const { base, changes } = this.state.now;
    if (location.hash === fragmentOf(this.state.now)) return false;
    const known = (/** @type {string} */ path) => !this.form.keys.size || this.form.keys.has(path);
    const found = readFragment(location.hash, base, known);
    this.list(this.remarks, found.sentences);
    this.state.now = { base, changes: found.changes };
    this.form.show();
    return JSON.stringify(changes) !== JSON.stringify(found.changes);
  }

  /** @param {() => void} act */
  change(act) {
    const before = this.state.now;
    act();
    if (this.state.now !== before) this.moved();
  }

  /** @param {1 | -1} way */
  async step(way) {
    if (!this.state.step(way)) return;
    if (this.state.now.base !== this.described) await this.describe();
    this.moved();
  }

  /** Shows the state that is now, and its run as soon as there is one. */
  moved() {
    const drawn = this.run();
    // While the worker is at it.
    this.form.show();
    this.map.moved();
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.rest(), REST_MS);
    this.root.dataset.settled = "false";
    this.tell("");
    this.command.textContent = commandOf(this.state.now.base.file, this.state.sets);
    return drawn;
  }

  /** Runs what the page says and draws it; gives the run, if it has no errors and is the newest. @param {boolean} [confirm] */
  async run(confirm = false) {
    const begun = performance.now();
    this.busy = true;
    // At rest all is there, for paper too.
    const request = { columns: true, loops: this.loops.inView || confirm, confirm };
    const laws = this.ladder ? (this.state.now.base.rungs ?? this.description?.rungs ?? []) : [];
    const { now } = this.state;
    const answer = await this.ask("simulate", request, LIVE);
    if (!answer) return null;
    const runs = [];
    for (const law of answer.errors ? [] : laws) {
      const sets = [...this.state.sets, `controller.law=${law}`];
      const rung = await this.ask("simulate", { ...request, sets }, ASKED);
      if (rung && !rung.errors) runs.push(rung);
      // Moved meanwhile: the next run draws its own rungs.
      if (this.state.now !== now) return null;
    }
    this.busy = false;
    const broken = answer.errors != null;
    this.problem(answer.errors ?? []);
    this.root.classList.toggle("stale", broken);
    if (broken) return null;
    this.live = answer;
    this.looped = request.loops;
    this.rungs = runs.length ? runs : null;
    this.draw(confirm);
    // uPlot paints in a microtask.
    await null;
    const ended = performance.now();
    if (!confirm) {
      performance.measure("moved to drawn", { start: begun, end: ended });
      this.root.dataset.drawnMs = (ended - begun).toFixed(2);
    }
    return answer;
  }

  /** @param {boolean} confirmed */
  draw(confirmed) {
    const { live, pinned, rungs } = this;
    if (!live) return;
    this.root.classList.remove("empty");
    const runs = { live, pinned, rungs, oneCommand: this.pinnedMotion === this.motion };
    this.pictures.show(runs);
    if (this.looped) this.loops.show(runs);
    this.figures.show(runs, confirmed);
    const law = `${live.law}, solver ${live.solver}`;
    if (this.law.textContent !== law) this.law.textContent = law;
  }

  /** The controls rest: digits that hold, one step for undo, the address, and words for a screen reader. */
  async rest() {
    this.state.keep();
    const { now } = this.state;
    this.undo.disabled = !this.state.past.length;
    this.redo.disabled = !this.state.future.length;
    if (this.options.ownsAddress) this.write();
    await this.run(true);
    if (this.state.now !== now || !this.live || this.root.classList.contains("stale")) return;
    const description = await this.ask("describe", {}, ASKED);
    if (this.state.now !== now) return;
    if (description && !description.errors) this.form.hold(description.sections);
    this.map.offer(this.live);
    this.pictures.name();
    this.loops.name();
    this.told.textContent = this.figures.words(this.live);
    this.root.dataset.settled = "true";
  }

  /** The address is the run; a file page in a frame may not write it. */
  write() {
    const fragment = fragmentOf(this.state.now);
    if (location.hash === fragment) return;
    try {
      history.replaceState(null, "", fragment || location.pathname + location.search);
    } catch (error) {
      this.tell(`The address could not be written (${error}): “Copy as --set” has the run.`);
    }
  }

  /** @param {HTMLElement} list @param {(string | Node)[]} sentences */
  list(list, sentences) {
    list.hidden = !sentences.length;
    list.replaceChildren(...sentences.map((sentence) => element("li", {}, sentence)));
  }

  /** Errors beside their keys and, with a way to them, in a list. @param {{ key: string | null, sentence: string }[]} errors */
  problem(errors) {
    if (!errors.length && this.problems.hidden) return;
    const without = this.form.tell(errors);
    this.list(this.problems, errors.map((error) => {
      const { key, sentence } = error;
      if (key == null || without.includes(error)) return sentence;
      const there = button(key, () => {
        this.form.reveal(key);
        const row = this.form.row(key);
        row.scrollIntoView({ block: "center" });
        /** @type {HTMLElement | null} */ (row.querySelector("input:not([type=range]), select"))?.focus();
      });
      return element("span", {}, there, " ", sentence);
    }));
  }

  /** What makes the command. */
  get motion() {
    return this.state.sets.filter((set) => set.startsWith("motion.")).sort().join();
  }

  setPin() {
    this.pinned = this.pinned ? null : this.live;
    this.pinnedMotion = this.motion;
    this.pin.textContent = this.pinned ? "Unpin" : "Pin this run";
    this.pin.setAttribute("aria-pressed", String(this.pinned != null));
    this.draw(this.root.dataset.settled === "true");
  }

  setLadder() {
    this.ladder = !this.ladder;
    this.rungsSwitch.setAttribute("aria-pressed", String(this.ladder));
    this.moved();
  }

  async save() {
    const answer = await this.ask("save", {}, ASKED);
    if (answer?.errors) return this.problem(answer.errors);
    const { name } = this.state.now.base;
    if (!answer) return;
    download(answer.text, `${name}.toml`);
    this.tell(`Saved as ${name}.toml.`);
  }

  /** Another file takes the place of this one, once it has no errors. @param {string} file @param {string} text */
  async openFile(file, text) {
    const name = file.replace(/\.toml$/, "");
    const base = { ...this.state.now.base, name, file, text, beside: undefined, sets: [], hash: "pasted", rungs: null };
    if (!(await this.describe(base))) {
      this.figures.refused();
      // The box stands far below.
      this.problems.scrollIntoView({ block: "center" });
      return;
    }
    base.name = plainText(this.form.keys.get("name")?.value) || name;
    this.title.textContent = base.name;
    this.state.now = { base, changes: {} };
    this.pinned = null;
    this.moved();
  }
}
