
// Curves with times of their own: on common times, and at one time.

// Curves { t, y, held, … } on the times of all of them; between its own points
// each is the straight line that it is drawn as, or holds. A time stands as often
// as in the curve that jumps there.
/** @import { Column } from "./chart.js" */

/**
 * @template {{ t?: Column, y: Column, held?: boolean }} Timed
 * @param {Timed[]} all @returns {{ x: Column, curves: Timed[] }}
 */
export function aligned(all) {
  const curves = all.map((curve) => ({ ...curve, t: curve.t ?? [] }));
  if (curves.every(({ t }) => t === curves[0].t)) return { x: curves[0].t, curves };
  /** @type {Column} */
  const x = [];
  const columns = curves.map(() => /** @type {Column} */ ([]));
  const next = curves.map(() => 0);
  for (;;) {
    const t = Math.min(...curves.map((curve, i) => curve.t[next[i]] ?? Infinity));
    if (t === Infinity) break;
    const here = curves.map((curve, i) => {
      let end = next[i];
      while (curve.t[end] === t) end++;
      return end - next[i];
    });
    const rows = Math.max(...here);
    for (let row = 0; row < rows; row++) {
      x.push(t);
      curves.forEach((curve, i) => {
        const at = next[i];
        if (here[i] > 0) columns[i].push(curve.y[at + Math.min(row, here[i] - 1)]);
        else columns[i].push(between(curve.t, curve.y, at, t, curve.held));
      });
    }
    here.forEach((points, i) => (next[i] += points));
  }
  return { x, curves: curves.map((curve, i) => ({ ...curve, y: columns[i] })) };
}

// A curve at time t, which is before its point number `after`.
/** @param {Column} times @param {Column} values @param {number} after @param {number} t @param {boolean} [held] */
function between(times, values, after, t, held) {
  const [v0, v1] = [values[after - 1], values[after]];
  if (v0 == null || v1 == null) return null;
  if (held) return v0;
  const [t0, t1] = [times[after - 1], times[after]];
  return v0 + ((v1 - v0) * (t - t0)) / (t1 - t0);
}

// A curve at any time; where it jumps, just after.
/** @param {Column} times @param {Column} values @param {number} t @param {boolean} [held] */
export function valueAt(times, values, t, held) {
  let [low, high] = [0, times.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] <= t) low = middle + 1;
    else high = middle;
  }
  if (times[low - 1] === t) return values[low - 1];
  return between(times, values, low, t, held);
}
