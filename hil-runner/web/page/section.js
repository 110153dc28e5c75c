// The simulator as a section of another page: the event "open-row", of a study's picture or a
// tune's front, opens a run in it.

import { mountLive } from "./live.js";

const sectionData = JSON.parse(document.getElementById("live-data")?.textContent ?? "{}");
const section = mountLive(/** @type {HTMLElement} */ (document.getElementById("live")), sectionData, {
  ownsAddress: false,
  ladder: Boolean(sectionData.rungs),
});
document.addEventListener("open-row", async (event) => {
  const { row, title = `row ${row}`, sets } = /** @type {CustomEvent} */ (event).detail;
  const { figures } = await section.open(sets, title);
  document.dispatchEvent(new CustomEvent("row-opened", { detail: { row, figures } }));
});
