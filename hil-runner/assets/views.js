// All plots of the page, and what the window does to them.

import { newColours } from "./chart.js";

/** @import { View } from "./chart.js" */

/** @type {View[]} */
export const views = [];

function fit() {
  for (const { chart, box } of views) {
    const size = { width: box.clientWidth, height: box.clientHeight };
    if (size.width !== chart.width || size.height !== chart.height) chart.setSize(size);
  }
}

function repaint() {
  newColours();
  for (const { chart } of views) chart.redraw(false);
}

/** @param {boolean} on */
function printing(on) {
  document.documentElement.classList.toggle("printing", on);
  fit();
  repaint();
}

const observer = new ResizeObserver(fit);
let followed = false;

// Plots have the size of their boxes in `page`, the colours of the scheme, and those of paper.
/** @param {Element} page */
export function followWindow(page) {
  observer.observe(page);
  if (followed) return;
  followed = true;
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", repaint);
  addEventListener("beforeprint", () => printing(true));
  addEventListener("afterprint", () => printing(false));
}
