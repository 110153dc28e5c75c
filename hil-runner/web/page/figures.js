// Figures with verdicts: the strip above the pictures and the table below them. Strings are the program's own.

import { element, MISSING, reading } from "../../assets/chart.js";

/** @import { Answer } from "./simulator.js" */
/** @import { Runs } from "./pictures.js" */

/** @typedef {{ key: string, label: string, unit: string, value: number | null, shown: string }} Figure */
/** @typedef {{ figure: string, label: string, unit: string, shown: string, shown_limit: string, shown_margin: string,
 *   at_least: boolean, default: boolean, pass: boolean }} Verdict */

/** Writes a text where it has changed: the browser lays out nothing else. @param {Element} cell @param {string} text */
function write(cell, text) {
  if (cell.textContent !== text) cell.textContent = text;
}

/** @param {Element} part @param {string} name */
function mark(part, name) {
  if (part.className !== name) part.className = name;
}

/** @param {Verdict} verdict */
const limitOf = ({ at_least, shown_limit, default: usual }) => `${at_least ? "≥ " : "≤ "}${shown_limit}${usual ? " *" : ""}`;

/** The verdict on a run in words, and its class. @param {Answer} run */
export function standingOf({ verdicts, reserved }) {
  const failed = verdicts.filter((/** @type {Verdict} */ { pass }) => !pass).length;
  if (failed) return { word: `✗ FAIL: ${failed} of ${verdicts.length} limits broken`, kind: "fail" };
  if (!verdicts.length) return { word: "no limits", kind: "none" };
  return reserved ? { word: `! ${reserved}`, kind: "reserved" } : { word: "✓ PASS: all limits kept", kind: "pass" };
}

export class Figures {
  /** @param {HTMLElement} strip @param {HTMLElement} tables */
  constructor(strip, tables) {
    this.standing = element("p", { className: "overall" });
    this.chips = element("ul", { className: "chips" });
    strip.append(this.standing, this.chips);
    this.warnings = element("ul", { className: "note", hidden: true });
    this.head = element("thead");
    this.body = element("tbody");
    this.table = element("table", { className: "figures wide" }, element("caption", { textContent: "Figures" }), this.head, this.body);
    const scroll = element("div", { className: "scroll", tabIndex: 0 }, this.table);
    scroll.setAttribute("role", "region");
    scroll.setAttribute("aria-label", "Figures of this run");
    const hint = "* a default limit: the run file sets none for this figure. Paler digits are not yet confirmed: a second run, its carriage heavier by 1e-12 of its mass, confirms them when the controls rest.";
    const parameters = element("details", { className: "section" }, element("summary", {}, element("b", { textContent: "Parameters" })));
    this.parameters = element("tbody");
    parameters.append(element("table", { className: "parameters" }, this.parameters));
    tables.append(this.warnings, scroll, element("p", { className: "hint", textContent: hint }), parameters);
    this.shape = "";
    /** @type {Runs | null} */
    this.runs = null;
    this.inView = false;
    new IntersectionObserver(([{ isIntersecting }]) => {
      this.inView = isIntersecting;
      this.fill();
    }).observe(tables);
  }

  /** @param {Runs} runs @param {boolean} confirmed */
  show(runs, confirmed) {
    this.runs = runs;
    const { word, kind } = standingOf(runs.live);
    // Of the ladder's rungs the chosen one is judged.
    write(this.standing, runs.rungs ? `${runs.live.law}: ${word}` : word);
    mark(this.standing, `overall ${kind}`);
    this.strip(runs.live);
    for (const part of [this.chips, this.table]) part.classList.toggle("unconfirmed", !confirmed);
    if (this.inView || confirmed) this.fill();
  }

  /** What is asked for makes no run: the verdict is not that of what is drawn. */
  refused() {
    write(this.standing, "– not run");
    this.standing.className = "overall none";
  }

  /** The judged figures. @param {Answer} live */
  strip({ verdicts }) {
    while (this.chips.children.length > verdicts.length) this.chips.lastChild?.remove();
    verdicts.forEach((/** @type {Verdict} */ verdict, /** @type {number} */ i) => {
      const chip = this.chips.children[i] ?? this.chips.appendChild(element("li", {}, element("span"), element("b"), element("small")));
      mark(chip, verdict.pass ? "pass" : "fail");
      const [label, value, limit] = chip.children;
      write(label, verdict.label || verdict.figure);
      write(value, `${verdict.pass ? "✓" : "✗"} ${verdict.shown} ${verdict.unit}`);
      write(limit, limitOf(verdict));
    });
  }

  /** The whole table, of what is to be seen. */
  fill() {
    if (!this.runs) return;
    const { live, pinned, rungs } = this.runs;
    const others = rungs ?? (pinned ? [live, pinned] : [live]);
    const names = rungs ? rungs.map(({ law }) => law) : pinned ? ["live", "pinned", "live − pinned"] : ["value"];
    const judged = new Map(live.verdicts.map((/** @type {Verdict} */ verdict) => [verdict.figure, verdict]));
    const known = new Map(others.flatMap(({ figures }) => figures.map((/** @type {Figure} */ figure) => [figure.key, figure])));
    const rows = [...known.values()].sort((a, b) => +judged.has(b.key) - +judged.has(a.key));
    const ofLaw = rungs ? `, ${live.law}` : "";
    const shape = JSON.stringify([names, ofLaw, rows.map(({ key }) => key)]);
    if (shape !== this.shape) this.build(names, rows, ofLaw);
    this.shape = shape;
    const of = others.map(({ figures }) => new Map(figures.map((/** @type {Figure} */ figure) => [figure.key, figure])));
    rows.forEach(({ key }, i) => {
      const cells = [...this.body.children[i].children].slice(1);
      const values = of.map((run) => run.get(key));
      values.forEach((figure, k) => write(cells[k], figure?.shown ?? MISSING));
      if (!rungs && pinned) {
        const [a, b] = values.map((figure) => figure?.value);
        write(cells[2], a == null || b == null ? MISSING : reading(a - b));
      }
      const verdict = judged.get(key);
      const [limit, margin, word] = cells.slice(-3);
      write(limit, verdict ? limitOf(verdict) : "");
      write(margin, verdict?.shown_margin ?? "");
      write(word, verdict ? (verdict.pass ? "✓ pass" : "✗ FAIL") : "");
      mark(word, verdict ? `verdict ${verdict.pass ? "pass" : "fail"}` : "");
    });
    const named = (/** @type {Answer} */ { law, warnings }) => warnings.map((/** @type {string} */ warning) => (rungs ? `${law}: ${warning}` : warning));
    const warnings = [...new Set((rungs ?? [live]).flatMap(named))];
    this.warnings.hidden = !warnings.length;
    const text = warnings.join("\n");
    if (this.warnings.dataset.text !== text) {
      this.warnings.dataset.text = text;
      this.warnings.replaceChildren(...warnings.map((textContent) => element("li", { textContent })));
    }
    const settings = JSON.stringify(live.parameters);
    if (this.parameters.dataset.text === settings) return;
    this.parameters.dataset.text = settings;
    this.parameters.replaceChildren(
      ...live.parameters.map((/** @type {any} */ { label, value, unit }) =>
        element(
          "tr", {}, element("th", { scope: "row", textContent: label }),
          element("td", { className: "n", textContent: value }), element("td", { textContent: unit }),
        ),
      ),
    );
  }

  /** @param {string[]} names @param {Figure[]} rows @param {string} judged the run that is, where there are more */
  build(names, rows, judged) {
    const head = (/** @type {string} */ textContent, className = "n") => element("th", { scope: "col", className, textContent });
    this.head.replaceChildren(
      element("tr", {}, head("figure", ""), ...names.map((name) => head(name)), head("unit", ""), head(`limit${judged}`), head(`margin${judged}`), head(`verdict${judged}`, "")),
    );
    this.body.replaceChildren(
      ...rows.map(({ key, label, unit }) => {
        const values = names.map((_, i) => element("td", { className: i ? "n" : "n shown" }));
        const ends = [element("td", { className: "n" }), element("td", { className: "n" }), element("td")];
        const row = element("tr", {}, element("th", { scope: "row", textContent: label, title: key }), ...values, element("td", { textContent: unit }), ...ends);
        row.dataset.figure = key;
        return row;
      }),
    );
  }

  /** What a screen reader hears at rest. @param {Answer} live */
  words(live) {
    const values = live.verdicts.map((/** @type {Verdict} */ { label, figure, shown, unit }) => `${label || figure} ${shown} ${unit}`);
    return `${standingOf(live).word.slice(2)}. ${values.join(", ")}`;
  }
}
