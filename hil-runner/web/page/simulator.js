// The page's side of the worker: one request in flight, the sliders' newest before all others,
// and an end to what takes too long.

import { carried, unpacked } from "../../assets/packed.js";

/**
 * An answer of the simulator: its JSON, with `data` for the columns.
 * @typedef {{ errors?: { key: string | null, sentence: string }[], data: Float64Array, [key: string]: any }} Answer
 * @typedef {{ method: string, request: object, limit: number, done: (answer: Answer | null) => void }} Job
 */

// Longest time for one run [ms].
const LONGEST_MS = 2000;

/** Lanes of requests, the first of them first; in `LIVE` a request takes the place of the one that waits. */
export const LIVE = 0, ASKED = 1, MAP = 2;

/** @param {ArrayBuffer} bytes @returns {Answer} */
function parsed(bytes) {
  const head = new DataView(bytes);
  const [length, count] = [head.getUint32(0, true), head.getUint32(4, true)];
  const json = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 8, length)));
  json.data = new Float64Array(bytes, Math.ceil((8 + length) / 8) * 8, count);
  return json;
}

export class Simulator {
  /** @param {string} source of the worker */
  constructor(source) {
    this.address = URL.createObjectURL(new Blob([source], { type: "text/javascript" }));
    /** @type {WebAssembly.Module | null} */
    this.module = null;
    /** @type {Job[][]} */
    this.lanes = [[], [], []];
    /** @type {Job | null} */
    this.job = null;
    this.id = 0;
    this.timer = 0;
    document.addEventListener("visibilitychange", () => this.next());
    /** @type {Promise<void>} the first worker is there, or is refused */
    this.started = new Promise((done, refuse) => {
      this.done = done;
      /** @type {((reason: Error) => void) | undefined} */
      this.refuse = refuse;
    });
    this.start();
  }

  /** The simulator of the page; throws where the browser refuses it. */
  static load() {
    return (Simulator.loading ??= Simulator.unpacked());
  }

  /** @type {Promise<Simulator> | undefined} */
  static loading;

  /** Starts the worker, which unpacks the image with another one. */
  static async unpacked() {
    const simulator = new Simulator(document.getElementById("live-worker")?.textContent ?? "");
    const unpacker = await (await unpacked("unpacker")).arrayBuffer();
    const packed = carried("simulator");
    simulator.worker?.postMessage({ unpacker, packed }, [unpacker, packed.buffer]);
    await simulator.started;
    return simulator;
  }

  start() {
    this.worker = new Worker(this.address);
    this.worker.onmessage = ({ data }) => this.hear(data);
    this.worker.onerror = (event) => this.fail(event.message || "the worker could not be started");
    if (this.module) this.worker.postMessage({ module: this.module });
  }

  /**
   * Asks for an answer; null if a newer request took its place.
   * @param {string} method @param {{ confirm?: boolean, [key: string]: any }} request @param {number} lane
   * @returns {Promise<Answer | null>}
   */
  ask(method, request, lane) {
    // To confirm is to run twice.
    const limit = LONGEST_MS * (request.confirm ? 2 : 1);
    return new Promise((done) => {
      if (lane === LIVE) this.drop(LIVE);
      this.lanes[lane].push({ method, request, limit, done });
      this.next();
    });
  }

  /** Takes back what waits in a lane. @param {number} lane */
  drop(lane) {
    for (const { done } of this.lanes[lane].splice(0)) done(null);
  }

  next() {
    if (this.job || document.hidden) return;
    const job = this.lanes.find((lane) => lane.length)?.shift();
    if (!job) return;
    this.job = job;
    this.timer = setTimeout(() => this.fail(""), job.limit);
    this.worker?.postMessage({ id: ++this.id, method: job.method, request: JSON.stringify(job.request) });
  }

  /** @param {{ module?: WebAssembly.Module, id?: number, answer?: ArrayBuffer, failed?: string }} message */
  hear({ module, id, answer, failed }) {
    if (module) {
      this.module = module;
      this.refuse = undefined;
      return this.done?.();
    }
    if (failed != null) return this.fail(failed);
    if (answer && id === this.id) this.end(parsed(answer));
  }

  /** Ends the worker and starts another: no reason is a run that took too long. @param {string} reason */
  fail(reason) {
    this.worker?.terminate();
    if (this.refuse) return this.refuse(new Error(reason));
    const sentence = reason
      ? `The simulator broke off (${reason}) and was started anew; what was drawn last stays.`
      : `This run takes longer than ${LONGEST_MS / 1000} s: it was ended and the simulator started anew; what was drawn last stays.`;
    this.start();
    this.end({ errors: [{ key: null, sentence }], data: new Float64Array() });
  }

  /** @param {Answer} answer */
  end(answer) {
    clearTimeout(this.timer);
    const job = this.job;
    this.job = null;
    job?.done(answer);
    this.next();
  }
}
