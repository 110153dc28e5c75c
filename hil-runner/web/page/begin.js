// Begins the page of `hil-runner live`, whose script stands in it packed.

import { enter, unpacked } from "../../assets/packed.js";
import { Simulator } from "./simulator.js";

// In its worker the image is unpacked while the script is; the page tells what fails.
Simulator.load().catch(() => {});
unpacked("script")
  .then((script) => script.text())
  .then(enter, (error) => {
    document.documentElement.dataset.state = "refused";
    document.body.prepend(`The browser does not unpack this page (${error}). Browsers since 2023 do; “hil-runner run” gives the same figures.`);
  });
