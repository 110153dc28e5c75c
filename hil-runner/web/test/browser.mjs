// The live pages in a browser without a network: what they show is what the program prints,
// nothing breaks their policy, and nothing that a user does leaves a blank page.
//
//   node browser.mjs PROGRAM BROWSER FOLDER [STILLS]
//
// STILLS is a folder for the pictures of the README.

import assert from "node:assert/strict";
import { execFileSync, spawnSync } from "node:child_process";
import { mkdirSync, readFileSync, statSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import path from "node:path";
import { pathToFileURL } from "node:url";

const [program, executablePath, folder, stills] = process.argv.slice(2);
const { chromium } = createRequire(path.join(folder, "package.json"))("playwright-core");
const out = path.join(folder, "pages");
mkdirSync(out, { recursive: true });
const file = (name) => path.join(out, name);
const hil = (...words) => execFileSync(program, words, { cwd: out, stdio: ["ignore", "pipe", "pipe"], encoding: "utf8" });
// Nothing of the browser's own goes to a network either.
const quiet = ["--disable-background-networking", "--disable-component-update", "--disable-sync", "--disable-quic", "--no-first-run"];
const browser = await chromium.launch({ executablePath, args: ["--no-sandbox", "--disable-gpu", ...quiet] });

/** Opens a page without a network; all that it complains of is kept. */
async function open(name, { hash = "", settled = true, ...options } = {}) {
  const context = await browser.newContext({ viewport: { width: 1400, height: 900 }, ...options });
  await context.setOffline(true);
  const page = await context.newPage();
  page.complaints = [];
  page.on("console", (message) => ["error", "warning"].includes(message.type()) && page.complaints.push(message.text()));
  page.on("pageerror", (error) => page.complaints.push(String(error)));
  page.on("request", (request) => /^https?:/.test(request.url()) && page.complaints.push(`asks for ${request.url()}`));
  await page.addInitScript(() => {
    globalThis.breaches = [];
    // Time from the navigation until the page is ready [ms].
    new MutationObserver(() => {
      if (document.documentElement?.dataset.state === "ready") globalThis.readyMs ??= performance.now();
    }).observe(document, { attributes: true, subtree: true });
    addEventListener("securitypolicyviolation", (event) => globalThis.breaches.push(`${event.violatedDirective} ${event.blockedURI}`));
  });
  await page.goto(pathToFileURL(file(name)) + hash);
  if (settled) await page.waitForSelector('.live[data-settled="true"]', { state: "attached" });
  return page;
}

/** Ends a page, which must not have complained. */
async function close(page) {
  assert.deepEqual([page.complaints, await page.evaluate(() => globalThis.breaches)], [[], []]);
  await page.context().close();
}

const rest = (page) => page.waitForSelector('.live[data-settled="true"]', { state: "attached" });

/** Waits for the run after what `act` does. */
async function after(page, act) {
  await page.evaluate(() => (document.querySelector(".live").dataset.settled = "false"));
  await act();
  await rest(page);
}

/** Sets a key by its box. */
async function set(page, key, value) {
  if (!(await page.locator(`[data-path="${key}"]`).count())) {
    await page.fill('input[type="search"]', key);
    await page.fill('input[type="search"]', "");
  }
  const row = page.locator(`[data-path="${key}"]`);
  await row.evaluate((element) => { for (let at = element; at; at = at.parentElement) if (at.tagName === "DETAILS") at.open = true; });
  const box = row.locator('select, input:not([type="range"])').first();
  const kind = await box.evaluate((element) => element.tagName + element.type);
  if (kind === "SELECTselect-one") return box.selectOption(value);
  if (kind === "INPUTcheckbox") return box.setChecked(value === "true");
  await box.fill(value);
  await box.press("Enter");
}

/** The figures of a page: key and the digits that it shows. */
const figures = (page) =>
  page.$$eval("table.figures tbody tr", (rows) => rows.map((row) => [row.querySelector("th").title, row.children[1].textContent]));

/** The same of the program's report of a run. */
async function printed(name, sets) {
  const report = file("printed.html");
  const { status, stderr } = spawnSync(program, ["run", name, ...sets.flatMap((each) => ["--set", each]), "--report", report], { cwd: out, encoding: "utf8" });
  assert.notEqual(status, 2, stderr);
  const page = await browser.newPage({ javaScriptEnabled: false });
  await page.goto(String(pathToFileURL(report)));
  const rows = await page.$$eval("section.case table.figures tbody tr", (all) => all.map((row) => [row.querySelector("th").title, row.children[1].textContent]));
  await page.close();
  return rows;
}

const median = (values) => values.toSorted((a, b) => a - b)[values.length >> 1];

/** A part of the test with its time. */
async function part(words, test) {
  const begun = performance.now();
  const found = await test();
  console.log(`${words}: ${found ? `${found}; ` : ""}${((performance.now() - begun) / 1000).toFixed(1)} s`);
}

const OWN = `name = "own"
[motor]
inertia_kg_cm2 = 0.6
torque_constant_nm_per_a = 0.11
resistance_ohm = 0.9
inductance_h = 0.0012
[transmission]
gear_ratio = 1.0
stiffness_n_per_um = 60
damping_ns_per_m = 3e4
backlash_um = 15
screw_inertia_kg_cm2 = 0.9
screw_pitch_mm_per_rev = 10
[carriage]
mass_kg = 18
resistance_constant_n = 12
resistance_opposes_motion = true
[drive]
dac_bits = 16
dac_range_v = 20
amplifier_gain = 4
voltage_limit_v = 40
[encoder]
lines = 2500
[controller]
law = "firmware"
kp = 6
ki_per_s = 60
kd_s = 0.06
sample_time_s = 0.0005
[motion]
travel_mm = 60
max_velocity_mps = 0.3
max_acceleration_mps2 = 3
max_jerk_mps3 = 100
[run]
duration_s = 0.8
`;
writeFileSync(file("own.toml"), OWN);

await part("a page of one case", async () => {
  hil("live", "paper-2", "--out", file("paper-2.html"));
  hil("live", "own.toml", "--out", file("own.html"));
  const size = statSync(file("paper-2.html")).size;
  assert.ok(size <= 700_000, `${size} bytes`);
  const ready = [];
  for (let i = 0; i < 5; i++) {
    const page = await open("paper-2.html");
    ready.push(await page.evaluate(() => globalThis.readyMs));
    await close(page);
  }
  // A page that loads would take longer.
  assert.ok(median(ready) <= 1000, `ready in ${ready} ms`);
  return `${size} bytes, ready in ${median(ready).toFixed(0)} ms (median of 5)`;
});

await part("300 moves of a slider", async () => {
  const page = await open("paper-2.html");
  const moves = () => page.evaluate(async () => {
    const slider = document.querySelector('[data-path="controller.kp"] input[type=range]');
    const drawn = [];
    for (let i = 0; i < 300; i++) {
      const count = performance.getEntriesByName("moved to drawn").length;
      slider.value = String(400 + (i % 200));
      slider.dispatchEvent(new Event("input", { bubbles: true }));
      while (performance.getEntriesByName("moved to drawn").length === count) await new Promise((next) => setTimeout(next, 0));
      drawn.push(performance.getEntriesByName("moved to drawn").at(-1).duration);
    }
    return drawn;
  });
  // Other work of the machine may hold up a round, not three.
  let times = await moves();
  for (let round = 1; round < 3 && median(times) > 16; round++) times = await moves();
  assert.equal(times.length, 300);
  assert.ok(median(times) <= 16, `moved to drawn in ${median(times)} ms`);
  await rest(page);
  await close(page);
  const most = times.toSorted((a, b) => a - b)[296];
  return `moved to drawn in ${median(times).toFixed(1)} ms (median), 99 % in ${most.toFixed(1)} ms`;
});

await part("figures are the program's digits", async () => {
  const settings = [
    ["paper-2.html", "paper-2", [
      [], ["controller.kp=4"], ["controller.ki_per_s=30"], ["controller.kd_s=0.08"], ["controller.sample_time_s=0.002"],
      ["transmission.backlash_half_deg=0.3"], ["carriage.mass_kg=80"], ["controller.law=continuous"], ["controller.law=sampled"],
      ["controller.law=quantised", "controller.kp=5.5"], ["drive.dac_bits=12"], ["controller.computation_delay_s=0.0005"],
      ["controller.anti_windup=clamp"], ["transmission.joint=rigid"], ["motion.travel_mm=50", "run.duration_s=2"],
    ]],
    ["own.html", "own.toml", [
      [], ["controller.velocity_ff_s=plant", "controller.acceleration_ff_s2=plant"], ["transmission.backlash_um=60"],
      ["carriage.resistance_constant_n=40"], ["motion.max_jerk_mps3=20", "run.duration_s=1.2"],
    ]],
  ];
  let [runs, digits] = [0, 0];
  for (const [name, given, all] of settings) {
    for (const sets of all) {
      const hash = sets.length ? `#${sets.map((each) => each.split("=").map(encodeURIComponent).join("=")).join("&")}` : "";
      const page = await open(name, { hash });
      const [shown, wanted] = [new Map(await figures(page)), await printed(given, sets)];
      assert.ok(wanted.length > 20);
      for (const [key, value] of wanted) {
        // A page has no clock.
        if (key === "host_step_p99_us") continue;
        assert.equal(shown.get(key), value, `${key} of ${given} ${sets}`);
        digits += value.length;
      }
      runs += 1;
      // The remarks about a link without version are not complaints.
      await close(page);
    }
  }
  // The contrast: another gain shows other digits.
  const page = await open("paper-2.html", { hash: "#controller.kp=3.3" });
  assert.notDeepEqual(await figures(page), await printed("paper-2", []));
  await close(page);
  return `${runs} settings, ${digits} characters`;
});

await part("every key of the form", async () => {
  const page = await open("paper-2.html");
  const keys = await page.evaluate(async () => {
    document.querySelectorAll(".keys details").forEach((part) => (part.open = true));
    await new Promise((next) => setTimeout(next, 50));
    return [...document.querySelectorAll(".keys [data-path]")].map((row) => {
      const control = row.querySelector('select, input:not([type="range"])');
      const value = control.tagName === "SELECT" ? [...control.options].at(-1).value : control.type === "checkbox" ? "true" : control.value || control.placeholder || "1";
      return [row.dataset.path, value, control.type];
    });
  });
  assert.ok(keys.length > 100, `${keys.length} keys`);
  let refused = 0;
  for (const [key, value, type] of keys) {
    await page.evaluate(([path, text, kind]) => {
      const control = document.querySelector(`.keys [data-path="${path}"]`).querySelector('select, input:not([type="range"])');
      if (kind === "checkbox") control.click();
      else {
        control.value = kind === "text" && !Number.isNaN(+text) ? String(+text * 1.01) : text;
        control.dispatchEvent(new Event("change", { bubbles: true }));
      }
    }, [key, value, type]);
    await page.waitForFunction(() => globalThis.performance && document.querySelector(".live").dataset.state === "ready");
    await page.waitForTimeout(15);
    if (await page.locator(".errors:not([hidden])").count()) refused += 1;
    await page.evaluate((path) => {
      const reset = document.querySelector(`.keys [data-path="${path}"] .reset-key`);
      if (!reset.hidden) reset.click();
    }, key);
  }
  await after(page, () => page.getByRole("button", { name: "Reset all" }).click());
  assert.equal(await page.locator(".errors:not([hidden])").count(), 0);
  assert.deepEqual(new Map(await figures(page)).get("peak_abs_acc_mps2"), "1.6457");
  await close(page);
  return `${keys.length} keys, ${refused} of the values refused beside their key`;
});

await part("a link is a run", async () => {
  const page = await open("paper-2.html");
  await after(page, () => set(page, "controller.kp", "4.5"));
  await after(page, () => set(page, "transmission.backlash_half_deg", "1"));
  const [address, shown] = [new URL(page.url()), await figures(page)];
  assert.match(address.hash, /controller\.kp=4\.5/);
  await close(page);
  const anew = await open("paper-2.html", { hash: address.hash });
  assert.deepEqual(await figures(anew), shown);
  await after(anew, () => anew.keyboard.press("Control+z"));
  await close(anew);
  for (const hash of ["#controller.kp=%E0%A4%A", "#controller.kp", "#strange.key=1", "#v=9.9&case=0&controller.kp=4", "#controller.kp=-1"]) {
    const broken = await open("paper-2.html", { hash, settled: false });
    await broken.waitForSelector('html[data-state="ready"]', { state: "attached" });
    const sentence = await broken.locator(".remarks:not([hidden]), .errors:not([hidden])").first().textContent({ timeout: 5000 });
    assert.ok(sentence.length > 20, hash);
    await close(broken);
  }
});

await part("by the keyboard alone", async () => {
  const page = await open("paper-2.html");
  const before = await figures(page);
  for (let i = 0; i < 200; i++) {
    await page.keyboard.press("Tab");
    if (await page.evaluate(() => document.activeElement.type === "range" && document.activeElement.closest("[data-path]").dataset.path === "controller.kp")) break;
  }
  await after(page, () => page.keyboard.press("ArrowRight"));
  const moved = await figures(page);
  assert.notDeepEqual(moved, before);
  await after(page, () => page.keyboard.press("Control+z"));
  assert.deepEqual(await figures(page), before);
  await after(page, () => page.keyboard.press("Control+y"));
  assert.deepEqual(await figures(page), moved);
  await close(page);
});

await part("360 px, dark, print", async () => {
  const phone = await open("paper-2.html", { viewport: { width: 360, height: 740 }, colorScheme: "dark" });
  const seen = await phone.evaluate(() => ({
    overflow: document.documentElement.scrollWidth - innerWidth,
    ground: getComputedStyle(document.body).backgroundColor,
  }));
  assert.ok(seen.overflow <= 0, `${seen.overflow} px wider than the screen`);
  const [red, green, blue] = seen.ground.match(/\d+/g).map(Number);
  assert.ok(red + green + blue < 200, seen.ground);
  await close(phone);
  const page = await open("paper-2.html");
  const pdf = await page.pdf();
  assert.ok(pdf.length > 20_000);
  await close(page);
});

await part("the policy holds", async () => {
  const page = await open("paper-2.html");
  // Later: a debugger's own call may compile text.
  await page.evaluate(() => new Promise((done) => setTimeout(() => {
    const foreign = document.createElement("script");
    foreign.textContent = "globalThis.foreign = true";
    document.body.append(foreign);
    try {
      new Function("globalThis.foreign = true")();
    } catch {
      // What is wanted.
    }
    done(undefined);
  }, 0)));
  assert.equal(await page.evaluate(() => globalThis.foreign), undefined);
  const breaches = await page.evaluate(() => globalThis.breaches);
  assert.equal(breaches.length, 2, String(breaches));
  await page.context().close();
});

await part("what breaks is told", async () => {
  const text = readFileSync(file("paper-2.html"), "utf8");
  // An image that is none.
  writeFileSync(file("refused.html"), text.replace(/(data-packed="simulator">)[^<]*/, "$1XQAAgAAFAAAAAAAAAAA0GUnuU1AAAA=="));
  const refused = await open("refused.html", { settled: false });
  const sentence = await refused.locator(".errors:not([hidden])").textContent({ timeout: 10_000 });
  assert.match(sentence, /does not run the simulator/);
  await refused.context().close();
  // A run that takes for ever.
  const page = await open("paper-2.html");
  await set(page, "run.duration_s", "20000");
  await page.locator(".errors:not([hidden])", { hasText: "takes longer than" }).waitFor({ timeout: 20_000 });
  await after(page, () => page.getByRole("button", { name: "Reset all" }).click());
  assert.equal(new Map(await figures(page)).get("peak_abs_acc_mps2"), "1.6457");
  // A run file with errors.
  await page.locator(".paste").evaluate((part) => (part.open = true));
  await page.locator(".paste textarea").fill("[motor]\ninertia = 3\n");
  await page.getByRole("button", { name: "Run this text" }).click();
  assert.match(await page.locator(".errors:not([hidden])").textContent(), /pasted\.toml:2: unknown key motor\.inertia/);
  await page.locator(".paste textarea").fill(OWN);
  await after(page, () => page.getByRole("button", { name: "Run this text" }).click());
  await close(page);
});

await part("a study's cell is its run", async () => {
  writeFileSync(file("small.toml"), `title = "Gains"
base = "paper-2"
rungs = ["firmware"]
[[axis]]
key = "controller.kp"
from = 2
to = 4
points = 5
[[axis]]
key = "controller.kd_s"
from = 0.03
to = 0.06
points = 4
[[picture]]
kind = "map"
file = "gains"
title = "Peak acceleration"
x = "controller.kp"
y = "controller.kd_s"
z = "peak_abs_acc_mps2"
[[picture]]
kind = "scatter"
file = "runs"
title = "Every run"
x = "peak_abs_acc_mps2"
y = "peak_following_error_mm"
`);
  hil("study", "small.toml", "--out", "small", "--live");
  const [head, ...lines] = readFileSync(file("small/results.csv"), "utf8").trim().split("\n").map((line) => line.split(","));
  const results = new Map(lines.map((line) => [Number(line[head.indexOf("row")]), Object.fromEntries(line.map((cell, i) => [head[i], cell]))]));
  const page = await open("small/report.html", { settled: false, reducedMotion: "reduce" });
  await page.waitForFunction(() => document.documentElement.dataset.ready);
  const ready = Number(await page.evaluate(() => document.documentElement.dataset.ready));
  let opened = 0;
  let numbers = 0;
  for (const [picture, mark] of [["gains", 'g.mark-rect.role-mark > path:not([d="M0,0h0v0h0Z"])'], ["runs", "g.mark-symbol.role-mark > path"]]) {
    const marks = page.locator(`#${picture} svg`).first().locator(mark);
    assert.ok((await marks.count()) >= 20, `${picture} has ${await marks.count()} marks`);
    for (const place of [0, 7, 19]) {
      await page.evaluate(() => {
        document.addEventListener("open-row", (event) => (globalThis.opened = event.detail), { once: true });
        document.addEventListener("row-opened", (event) => (globalThis.figures = event.detail.figures), { once: true });
        document.getElementById("live").dataset.settled = "false";
      });
      await marks.nth(place).click({ force: true });
      await rest(page);
      const { row, sets } = await page.evaluate(() => globalThis.opened);
      const wanted = results.get(row);
      const given = Object.fromEntries(sets.map((each) => each.split("=")));
      assert.equal(Number(given["controller.kp"]), Number(wanted["controller.kp"]), `row ${row}`);
      const shown = await page.evaluate(() => Object.fromEntries(globalThis.figures.map(({ key, value }) => [key, value])));
      for (const [key, value] of Object.entries(shown)) {
        if (!(key in wanted)) continue;
        assert.equal(value == null ? "" : String(value), wanted[key] === "" ? "" : String(Number(wanted[key])), `${key} of row ${row}`);
        numbers += 1;
      }
      opened += 1;
    }
  }
  assert.ok(numbers > 100);
  await close(page);
  return `pictures ready in ${ready.toFixed(0)} ms, ${opened} runs opened, ${numbers} figures the same to the last bit`;
});

if (stills) {
  const shoot = async (name, act) => {
    const page = await open("paper-2.html", { viewport: { width: 1180, height: 760 } });
    await act(page);
    await rest(page);
    await page.screenshot({ path: path.join(stills, `live-${name}.png`) });
    await close(page);
  };
  await shoot("pinned", async (page) => {
    await page.getByRole("button", { name: "Pin this run" }).click();
    await after(page, () => set(page, "transmission.backlash_half_deg", "0.3"));
  });
  await shoot("ladder", (page) => after(page, () => page.getByRole("button", { name: "Ladder" }).click()));
  await shoot("map", async (page) => {
    await page.getByRole("button", { name: "Compute map" }).click();
    await page.getByRole("button", { name: "Stop" }).waitFor();
    await page.getByRole("button", { name: "Compute map" }).waitFor({ timeout: 120_000 });
    await page.locator("canvas.map").scrollIntoViewIfNeeded();
  });
}

await browser.close();
