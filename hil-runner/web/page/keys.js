// The run file as a form: a row for each key with its slider, box, switch or choice.

import { element, minus } from "../../assets/chart.js";

/**
 * A key as the simulator describes it.
 * @typedef {{ path: string, unit: string, meaning: string, note?: string, kind: string, word: string | null,
 *   choices: string[] | null, low: number | null, high: number | null, above: boolean, allowed: string,
 *   default: string | null, value: string | null, held: number | null, acts: string[], excludes: string[] }} Key
 * @typedef {{ sections: { name: string, meaning: string, keys: Key[] }[], rungs: string[] }} Description
 * @typedef {{ low: number, high: number, log: boolean, whole: boolean }} Range
 * @typedef {{ key: Key, element: HTMLElement, show: (anew?: boolean) => void, tell: (sentences: string[]) => void }} Row
 */

/** Steps of a slider. */
const POSITIONS = 1000;

/** What stands first, where the file gives it. */
const FAVOURITES = [
  "controller.law", "controller.kp", "controller.ki_per_s", "controller.kd_s",
  "controller.kp_v_per_rad", "controller.ki_v_per_rad_s", "controller.kd_vs_per_rad",
  "controller.kp_a_per_rad", "controller.ki_a_per_rad_s", "controller.kd_as_per_rad",
  "controller.kv_per_s", "controller.velocity_gain_vs_per_rad", "controller.velocity_gain_as_per_rad",
  "controller.velocity_reset_s", "controller.sample_time_s", "controller.computation_delay_s",
  "transmission.backlash_half_deg", "transmission.backlash_um", "carriage.mass_kg", "drive.dac_bits",
  "motion.travel_mm", "motion.total_time_s", "motion.max_velocity_mps", "motion.max_acceleration_mps2", "motion.max_jerk_mps3",
];

/** @param {string | null | undefined} text a value in TOML */
export const plainText = (text) => (text ?? "").replace(/^"([^"\\]*)"$|^'([^']*)'$/, "$1$2");

/** @param {string | null | undefined} text @returns {number | null} */
export function numberOf(text) {
  const value = Number((text ?? "").replaceAll("_", ""));
  return text?.trim() && Number.isFinite(value) ? value : null;
}

/** Keys of which a slider can be made. @param {Key} key */
export const isNumber = ({ kind }) => ["number", "time", "whole"].includes(kind);

/**
 * A slider's range: the key's own where that is narrow, else a decade each way of `around`; logarithmic for
 * what cannot be negative, with 0 at its left end where 0 is allowed.
 * @param {Key} key @param {number} around @returns {Range}
 */
export function rangeOf({ kind, low, high, above }, around) {
  const whole = kind === "whole";
  if (low != null && high != null && (whole ? high - low <= 1000 : high - low <= 1e3 && low <= 0)) {
    return { low, high, log: false, whole };
  }
  const size = Math.abs(around);
  if (low != null && low >= 0 && size > 0) {
    const least = Math.max(around / 10, whole ? Math.max(low, 1) : low);
    const most = Math.min(around * 10, high ?? Infinity);
    return { low: least, high: Math.max(most, least * 1.01), log: true, whole };
  }
  const most = Math.min(2 * size || 1, high ?? Infinity);
  return { low: Math.max(low ?? -most, -most), high: most, log: false, whole };
}

/** The value at a share of the range, with three digits. @param {Key} key @param {Range} range @param {number} share */
export function valueAtShare(key, { low, high, log, whole }, share) {
  if (log && share <= 0 && key.low === 0 && !key.above) return 0;
  const value = log ? low * (high / low) ** share : low + (high - low) * share;
  if (whole) return Math.round(value);
  // A linear range has no digits below its step.
  const unit = 10 ** Math.floor(Math.log10((high - low) / POSITIONS));
  return +(log ? value : unit * Math.round(value / unit)).toPrecision(3);
}

/** @param {Range} range @param {number} value */
export function shareOf({ low, high, log }, value) {
  const share = log ? (value > 0 ? Math.log(value / low) / Math.log(high / low) : 0) : (value - low) / (high - low);
  return Math.min(1, Math.max(0, share));
}

/** The rest of a key's way to say something that the file says in another one. @param {Key} key @param {Map<string, Key>} keys */
const restOfWay = (key, keys) =>
  [...keys.values()].filter(
    (other) => other !== key && key.value == null && other.value == null && key.excludes.length > 0 &&
      `${other.excludes}` === `${key.excludes}`,
  );

export class Form {
  /**
   * @param {HTMLElement} host
   * @param {{ given: (path: string) => string | undefined, dropped: (key: Key) => string | undefined,
   *   set: (path: string, value: string | null) => void }} state what the page has set, the key that has taken
   *   this one's place, and how to set one
   * @param {string} prefix of the ids, for a page has more than one form
   */
  constructor(host, state, prefix) {
    this.host = host;
    this.state = state;
    this.prefix = prefix;
    /** @type {Map<string, Key>} as the file has them */
    this.keys = new Map();
    /** @type {Map<string, number | null>} what the case holds for them now */
    this.held = new Map();
    /** @type {Map<string, Row>} rows that have been made */
    this.rows = new Map();
    /** @type {Map<string, string[]>} */
    this.errors = new Map();
  }

  /** Makes the form anew for a file. @param {Description} description */
  describe({ sections, rungs }) {
    this.rungs = rungs;
    this.keys = new Map(sections.flatMap(({ keys }) => keys.map((key) => [key.path, key])));
    this.rows.clear();
    this.errors.clear();
    this.hold(sections);
    const shown = (/** @type {string} */ path) =>
      this.keys.get(path)?.value != null || (path === "motion.total_time_s" && this.held.get(path) != null);
    const first = FAVOURITES.filter(shown);
    const parts = sections.map(({ name, meaning, keys }) => {
      const rest = keys.filter(({ path }) => !first.includes(path));
      const part = element("details", { className: "section" });
      part.append(
        element("summary", {}, element("b", { textContent: name || "run" }), ` ${meaning}`, element("span", { className: "count" })),
      );
      // Rows are made when a section is opened or a search finds them.
      part.addEventListener("toggle", () => part.open && part.append(...rest.map(({ path }) => this.row(path))));
      return { part, rest };
    });
    this.parts = parts.filter(({ rest }) => rest.length);
    const favourites = element("div", { className: "favourites" }, ...first.map((path) => this.row(path)));
    const none = (this.none = element("p", { className: "hint", hidden: true }));
    this.host.replaceChildren(favourites, none, ...this.parts.map(({ part }) => part));
    this.first = first;
  }

  /** Takes what the case holds now, from a later description. @param {Description["sections"]} sections */
  hold(sections) {
    for (const { path, held, acts } of sections.flatMap(({ keys }) => keys)) {
      this.held.set(path, held);
      const key = this.keys.get(path);
      if (key) key.acts = acts;
    }
    this.show();
  }

  /** The text of a key now: the page's, the file's, or none. @param {Key} key */
  text(key) {
    return this.state.given(key.path) ?? (this.state.dropped(key) ? null : key.value);
  }

  /** The number of a key now, given or derived. @param {Key} key */
  number(key) {
    return numberOf(this.text(key)) ?? this.held.get(key.path) ?? numberOf(key.default);
  }

  get law() {
    const key = this.keys.get("controller.law");
    return key ? plainText(this.text(key) ?? key.default) : "";
  }

  /** What a slider of a key that is 0 goes by: a controller's times by its sample time. @param {Key} key */
  scale({ kind, path }) {
    const sample = this.keys.get("controller.sample_time_s");
    return (kind === "time" && path.startsWith("controller.") && sample && this.number(sample)) || 0;
  }

  /** Sets a key to a text, which the file's own is not. @param {Key} key @param {string} text */
  put(key, text) {
    const words = text.trim();
    const number = numberOf(words);
    const file = !words || plainText(key.value) === words || (number != null && number === numberOf(key.value));
    if (file) this.unset(key);
    else this.setWay(key, words);
    // What was typed may be another way to write what is there.
    this.rows.get(key.path)?.show(true);
  }

  /** @param {Key} key @param {string} words */
  setWay(key, words) {
    // One key of another way alone would be refused: the rest of that way keeps what it is now.
    for (const other of this.state.given(key.path) == null ? restOfWay(key, this.keys) : []) {
      const held = this.held.get(other.path);
      const digits = other.kind === "whole" ? held?.toFixed(0) : held?.toPrecision(12);
      if (digits && this.state.given(other.path) == null) this.state.set(other.path, String(+digits));
    }
    this.state.set(key.path, words);
  }

  /** Gives a key back to the file, with the rest of its way. @param {Key} key */
  unset(key) {
    for (const { path } of [key, ...restOfWay(key, this.keys)]) {
      if (this.state.given(path) != null) this.state.set(path, null);
    }
  }

  /** True of a set that says what the file says. @param {string} set */
  hasAlready(set) {
    const [path, value] = [set.slice(0, set.indexOf("=")).trim(), set.slice(set.indexOf("=") + 1).trim()];
    const own = this.keys.get(path)?.value;
    return own != null && (plainText(own) === plainText(value) || (numberOf(own) != null && numberOf(own) === numberOf(value)));
  }

  /** @param {string} path */
  row(path) {
    const key = /** @type {Key} */ (this.keys.get(path));
    const row = this.rows.get(path) ?? this.make(key);
    if (!this.rows.has(path)) {
      this.rows.set(path, row);
      row.show();
      row.tell(this.errors.get(path) ?? []);
    }
    return row.element;
  }

  /** @param {Key} key @returns {Row} */
  make(key) {
    const id = `${this.prefix}-${key.path}`;
    const meaning = key.meaning.replace(/,$/, "");
    const unit = key.unit ? ` [${key.unit}]` : "";
    const label = element("label", { htmlFor: id, title: key.note ?? "" }, meaning, " ", element("code", { textContent: key.path }));
    const words = key.choices || key.kind === "flag" ? "" : key.allowed;
    const allowed = [words, key.default && `default ${plainText(key.default)}`].filter(Boolean).join(" · ");
    // One line, whatever it says: a row that grew under the pointer would lose its click.
    const hint = element("p", { className: "file", id: `${id}-hint` });
    const idle = element("p", { className: "idle", textContent: `Does not act on this rung; it does on ${key.acts.join(", ")}.` });
    const error = element("p", { className: "error", id: `${id}-error` });
    const reset = element("button", { type: "button", className: "reset-key", textContent: "↺" });
    reset.title = "back to the file's value";
    reset.setAttribute("aria-label", `Reset ${meaning}`);
    reset.addEventListener("click", () => {
      this.unset(key);
      control.focus();
    });
    const { control, slider, show } = this.control(key, id);
    control.setAttribute("aria-describedby", `${id}-hint ${id}-error`);
    const line = element("div", { className: "line" }, ...(slider ? [slider] : []), control, element("span", { className: "unit", textContent: key.unit }), reset);
    const box = element("div", { className: `key ${key.kind}` }, label, line, hint, idle, error);
    box.dataset.path = key.path;
    let shown = "";
    const row = {
      key, element: box, show: (anew = false) => {
        const given = this.state.given(key.path);
        const dropped = this.state.dropped(key);
        // A slider's move changes one row of many.
        const what = [given, dropped, this.law, this.held.get(key.path), key.acts].join("\n");
        if (what === shown && !anew) return;
        shown = what;
        box.classList.toggle("changed", given != null);
        box.classList.toggle("dropped", dropped != null);
        reset.hidden = given == null;
        const was = key.value == null ? "not in the file" : `file: ${plainText(key.value)} ${key.unit}`.trim();
        const now = [dropped && `replaced by ${dropped}`, (given ?? dropped) != null && was, allowed].filter(Boolean).join(" · ");
        if (hint.textContent !== now) hint.title = hint.textContent = now;
        idle.hidden = key.acts.includes(this.law);
        show();
      },
      tell: (/** @type {string[]} */ sentences) => {
        error.textContent = sentences.join(" ");
        error.hidden = !sentences.length;
        control.setAttribute("aria-invalid", String(sentences.length > 0));
      },
    };
    if (slider) slider.setAttribute("aria-label", meaning + unit);
    return row;
  }

  /**
   * The control of a key, a slider beside it, and what shows its value.
   * @param {Key} key @param {string} id
   * @returns {{ control: any, slider?: HTMLInputElement, show: () => void }}
   */
  control(key, id) {
    if (key.kind === "flag") {
      const control = element("input", { type: "checkbox", id });
      control.addEventListener("change", () => this.put(key, String(control.checked)));
      return { control, show: () => (control.checked = (this.text(key) ?? key.default) === "true") };
    }
    if (key.choices) {
      const words = key.choices.map((word) => element("option", { value: word, textContent: word }));
      const none = key.value == null && key.default == null ? [element("option", { value: "", textContent: "–" })] : [];
      const control = element("select", { id }, ...none, ...words);
      control.addEventListener("change", () => this.put(key, control.value));
      return { control, show: () => (control.value = plainText(this.text(key) ?? key.default)) };
    }
    const control = element("input", { type: "text", id, spellcheck: false, autocomplete: "off" });
    if (isNumber(key) && !key.word) control.inputMode = "decimal";
    control.addEventListener("change", () => this.put(key, control.value));
    const showText = () => {
      const held = this.held.get(key.path);
      control.placeholder = plainText(key.default) || (held == null ? "" : minus(String(+held.toPrecision(5))));
      const text = plainText(this.text(key));
      if (control.value !== text) control.value = text;
    };
    if (!isNumber(key)) return { control, show: showText };
    const slider = element("input", { type: "range", min: 0, max: POSITIONS, step: 1 });
    /** @type {Range | null} */
    let range = null;
    slider.addEventListener("input", () => {
      if (!range) return;
      const own = numberOf(key.value);
      const at = +slider.value;
      const isFile = own != null && Math.round(POSITIONS * shareOf(range, own)) === at;
      this.put(key, isFile ? "" : String(valueAtShare(key, range, at / POSITIONS)));
    });
    const show = () => {
      showText();
      const value = this.number(key);
      slider.disabled = value == null;
      if (value == null) return;
      const around = numberOf(key.value) ?? value;
      range ??= rangeOf(key, around || this.scale(key));
      const isZero = value === 0 && key.low === 0;
      // A value from outside brings its own range.
      if ((value < range.low && !isZero) || value > range.high) range = rangeOf(key, value);
      const at = String(Math.round(POSITIONS * shareOf(range, value)));
      if (slider.value !== at) slider.value = at;
      slider.setAttribute("aria-valuetext", `${+value.toPrecision(4)} ${key.unit}`);
    };
    return { control, slider, show };
  }

  /** Shows the page's values in all rows that are there. */
  show() {
    for (const row of this.rows.values()) row.show();
    for (const { part, rest } of this.parts ?? []) {
      const changed = rest.filter(({ path }) => this.state.given(path) != null).length;
      const count = /** @type {HTMLElement} */ (part.querySelector(".count"));
      const text = changed ? `${changed} changed` : "";
      if (count.textContent !== text) count.textContent = text;
    }
  }

  /** Shows errors beside their keys, whose sections open; gives those that have no key here. @param {{ key: string | null, sentence: string }[]} errors */
  tell(errors) {
    this.errors = new Map();
    for (const { key, sentence } of errors) {
      if (key != null && this.keys.has(key)) this.errors.set(key, [...(this.errors.get(key) ?? []), sentence]);
    }
    for (const path of this.errors.keys()) this.reveal(path);
    for (const [path, row] of this.rows) row.tell(this.errors.get(path) ?? []);
    return errors.filter(({ key }) => key == null || !this.keys.has(key));
  }

  /** Makes a key visible. @param {string} path */
  reveal(path) {
    const found = this.parts?.find(({ rest }) => rest.some((key) => key.path === path));
    if (found && !found.part.open) found.part.open = true;
  }

  /** Shows the keys that have all words of a search, by path, meaning, unit and note. @param {string} text */
  search(text) {
    const words = text.toLowerCase().split(/\s+/).filter(Boolean);
    const found = (/** @type {Key} */ { path, meaning, unit, note }) =>
      words.every((word) => `${path} ${meaning} ${unit} ${note ?? ""}`.toLowerCase().includes(word));
    let count = 0;
    const sift = (/** @type {Key} */ key) => {
      const hit = found(key);
      count += hit ? 1 : 0;
      return hit;
    };
    for (const path of this.first ?? []) this.row(path).hidden = !sift(/** @type {Key} */ (this.keys.get(path)));
    for (const { part, rest } of this.parts ?? []) {
      const hits = new Set(rest.filter(sift));
      const some = words.length > 0 && hits.size > 0;
      // All rows of a section are made when one is to be seen.
      for (const key of rest) if (some || this.rows.has(key.path)) this.row(key.path).hidden = !hits.has(key);
      if (some) part.append(...rest.map(({ path }) => this.row(path)));
      part.hidden = !hits.size;
      part.open = some;
    }
    if (this.none) {
      this.none.hidden = !words.length;
      this.none.textContent = count ? `${count} ${count === 1 ? "key" : "keys"}` : "No key has all these words in its path, meaning or unit.";
    }
  }
}
