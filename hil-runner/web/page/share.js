// What goes out of the page and into it: `--set` words, the command, a run file.

import { element } from "../../assets/chart.js";

/** A word for a POSIX shell. @param {string} word */
const quoted = (word) => (/^[\w@%+=:,./-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`);

/** @param {string[]} sets */
export const setWords = (sets) => sets.map((set) => `--set ${quoted(set)}`).join(" ");

/** The command that gives the same figures; a file from standard input is read there. @param {string} file @param {string[]} sets */
export const commandOf = (file, sets) => `hil-runner run ${file === "stdin" ? "-" : quoted(file)} ${setWords(sets)}`.trim();

/** Copies a text, and without leave of the browser shows it selected. @param {HTMLButtonElement} button @param {string} text @param {(sentence: string) => void} tell */
export async function copy(button, text, tell) {
  try {
    await navigator.clipboard.writeText(text);
    tell("Copied.");
  } catch {
    const box = element("textarea", { value: text });
    button.after(box);
    box.select();
    const done = document.execCommand("copy");
    box.remove();
    button.focus();
    tell(done ? "Copied." : `The browser does not let the page copy: ${text}`);
  }
}

/** @param {string} text @param {string} name */
export function download(text, name) {
  const href = URL.createObjectURL(new Blob([text], { type: "application/toml" }));
  element("a", { href, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(href), 60000);
}

/**
 * A box for a whole run file: pasted, opened or dropped.
 * @param {HTMLElement} root where files may be dropped @param {(name: string, text: string) => void} open
 */
export function fileBox(root, open) {
  const box = element("details", { className: "section paste" });
  const text = element("textarea", { rows: 8, spellcheck: false, placeholder: "[motor]\n…" });
  text.setAttribute("aria-label", "A whole run file");
  const use = element("button", { type: "button", textContent: "Run this text" });
  use.addEventListener("click", () => open("pasted.toml", text.value));
  const picker = element("input", { type: "file", accept: ".toml,text/plain" });
  picker.setAttribute("aria-label", "Open a run file");
  const read = async (/** @type {File | undefined} */ file) => {
    if (!file) return;
    text.value = await file.text();
    open(file.name, text.value);
  };
  picker.addEventListener("change", () => read(picker.files?.[0]));
  root.addEventListener("dragover", (event) => event.preventDefault());
  root.addEventListener("drop", (event) => {
    event.preventDefault();
    read(event.dataTransfer?.files[0]);
  });
  box.append(
    element("summary", {}, element("b", { textContent: "Another run file" }), " paste, open or drop one"),
    text, element("div", { className: "bar-line" }, use, picker),
  );
  return box;
}
