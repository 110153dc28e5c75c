// What the page shows: a case, the keys that differ from it, the way back, and the address.

/**
 * `sets` belong to the case: those of the command line that made the page; `beside` has the files that the run file names.
 * @typedef {{ name: string, file: string, text: string, beside?: Record<string, string>, sets: string[], hash: string, version: string, rungs?: string[] | null }} Case
 * Paths of changed keys with their values, as `--set` takes them.
 * @typedef {Record<string, string>} Changes
 * @typedef {{ base: Case, changes: Changes }} Snapshot
 */

/** @param {string} set */
const pathOf = (set) => set.split("=", 1)[0].trim();

/** @param {Snapshot} a @param {Snapshot} b */
const same = (a, b) => a.base === b.base && JSON.stringify(a.changes) === JSON.stringify(b.changes);

export class State {
  /** @param {Case} base */
  constructor(base) {
    /** @type {Snapshot} */
    this.now = { base, changes: {} };
    /** @type {Snapshot} what the last step ended at */
    this.kept = this.now;
    /** @type {Snapshot[]} */
    this.past = [];
    /** @type {Snapshot[]} */
    this.future = [];
    /** @type {Record<string, string[]>} other ways to say what a key says */
    this.excludes = {};
  }

  /** Sets a key, or with null gives it back to the file. @param {string} path @param {string | null} value */
  set(path, value) {
    const changes = { ...this.now.changes };
    if (value == null) delete changes[path];
    else {
      for (const other of this.excludes[path] ?? []) delete changes[other];
      changes[path] = value;
    }
    this.now = { ...this.now, changes };
  }

  /** All of `--set`: a key of the page stands for the same one, and for its other ways, of the command line. */
  get sets() {
    const { base, changes } = this.now;
    const gone = new Set(Object.keys(changes).flatMap((path) => [path, ...(this.excludes[path] ?? [])]));
    const stay = base.sets.filter((set) => !gone.has(pathOf(set)));
    return [...stay, ...Object.entries(changes).map(([path, value]) => `${path}=${value}`)];
  }

  /** Changes that make the sets of another run of the same file. @param {string[]} sets */
  open(sets) {
    const own = new Set(this.now.base.sets);
    const entries = sets.filter((set) => !own.has(set)).map((set) => [pathOf(set), set.slice(set.indexOf("=") + 1).trim()]);
    this.now = { ...this.now, changes: Object.fromEntries(entries) };
  }

  /** Ends a step: what moved since the last one is undone at once. */
  keep() {
    if (same(this.now, this.kept)) return;
    this.past.push(this.kept);
    this.future = [];
    this.kept = this.now;
  }

  /** @param {1 | -1} way back or forth @returns {boolean} */
  step(way) {
    this.keep();
    const [from, to] = way < 0 ? [this.past, this.future] : [this.future, this.past];
    const there = from.pop();
    if (!there) return false;
    to.push(this.now);
    this.now = this.kept = there;
    return true;
  }
}

/** @param {Snapshot} now */
export function fragmentOf({ base, changes }) {
  const entries = Object.entries(changes);
  if (!entries.length) return "";
  const pairs = [...entries, ["v", base.version], ["case", base.hash]];
  return `#${pairs.map((pair) => pair.map(encodeURIComponent).join("=")).join("&")}`;
}

/**
 * Reads an address: changes, and a sentence for each thing that is not as it should be.
 * @param {string} fragment @param {Case} base @param {(path: string) => boolean} known
 * @returns {{ changes: Changes, sentences: string[] }}
 */
export function readFragment(fragment, base, known) {
  /** @type {Changes} */
  const changes = {};
  const sentences = [];
  const cut = (/** @type {string} */ words) => (words.length > 60 ? `${words.slice(0, 60)}…` : words);
  for (const part of fragment.replace(/^#/, "").split("&").filter(Boolean)) {
    const shown = cut(part);
    /** @type {string[]} */
    let pair;
    try {
      pair = part.split("=").map(decodeURIComponent);
    } catch {
      pair = [];
    }
    const [path, value] = pair;
    if (pair.length !== 2 || !value) {
      sentences.push(`The address has “${shown}”, which is not path=value, percent-coded; it is left out.`);
    } else if (path === "v") {
      if (value !== base.version) sentences.push(`The link is of version ${cut(value)}, this page of ${base.version}: figures may differ.`);
    } else if (path === "case") {
      if (value !== base.hash) sentences.push(`The link is of another case (${cut(value)}), this page of ${base.hash}: its changes are applied to this one.`);
    } else if (!known(path)) {
      sentences.push(`The address sets “${cut(path)}”, which is no key of the run file; it is left out.`);
    } else if (path in changes) {
      sentences.push(`The address sets ${path} twice; the first, ${cut(changes[path])}, is taken.`);
    } else changes[path] = value;
  }
  return { changes, sentences };
}
