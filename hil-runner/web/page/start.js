// The page of `hil-runner live`: the address is the run.

import { mountLive } from "./live.js";

mountLive(
  /** @type {HTMLElement} */ (document.getElementById("live")),
  JSON.parse(document.getElementById("live-data")?.textContent ?? "{}"),
  { ownsAddress: true },
);
