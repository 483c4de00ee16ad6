// Axes: ranges, ticks and their numbers, linear and logarithmic.

import { digits, prefixOf } from "./units.js";

/** 1, 2 or 5 times a power of ten near `x`. */
export function niceStep(x) {
  const power = 10 ** Math.floor(Math.log10(x)), rest = x / power;
  return power * (rest < 1.5 ? 1 : rest < 3.5 ? 2 : rest < 7.5 ? 5 : 10);
}

/** The finite extremes of numbers. */
export function extremes(lists) {
  let low = Infinity, high = -Infinity;
  for (const list of lists) for (const x of list) if (Number.isFinite(x)) { low = Math.min(low, x); high = Math.max(high, x); }
  return [low, high];
}

/** An axis from `low` to `high` [unit] over pixels from `start` to `end`. */
export class Axis {
  constructor(low, high, { log = false, pad = 0.05, unit = "", label = "" } = {}) {
    this.log = log && low > 0;
    this.unit = unit;
    this.label = label;
    if (!(low <= high)) [low, high] = this.log ? [1, 10] : [0, 1];
    if (this.log) {
      if (high <= low * 1.0001) [low, high] = [low / 2, high * 2];
    } else {
      const span = high - low;
      if (!(span > 1e-12 * Math.max(Math.abs(low), Math.abs(high)))) {
        const room = low === 0 ? 1 : 0.1 * Math.abs(low);
        [low, high] = [low - room, high + room];
      } else [low, high] = [low - pad * span, high + pad * span];
    }
    [this.low, this.high] = [low, high];
    const [factor, name] = this.log ? [1, ""] : prefixOf(Math.max(Math.abs(low), Math.abs(high)) * 0.999, unit);
    this.factor = factor;
    this.title = [label, unit ? `[${name}${unit}]` : ""].filter(Boolean).join(" ");
  }

  over(start, end) {
    [this.start, this.end] = [start, end];
    return this;
  }

  /** Pixel of a value. */
  at(x) {
    const s = this.log ? (Math.log(x) - Math.log(this.low)) / (Math.log(this.high) - Math.log(this.low)) : (x - this.low) / (this.high - this.low);
    return this.start + s * (this.end - this.start);
  }

  /** Value at a pixel. */
  value(pixel) {
    const s = (pixel - this.start) / (this.end - this.start);
    return this.log ? this.low * (this.high / this.low) ** s : this.low + s * (this.high - this.low);
  }

  /** Ticks as [value, text], about `count`. */
  ticks(count) {
    const found = [];
    if (this.log) {
      const decades = Math.log10(this.high / this.low), skip = Math.max(1, Math.ceil(decades / count));
      const steps = decades < 2 ? [1, 2, 5] : [1];
      for (let p = Math.floor(Math.log10(this.low)); p <= Math.ceil(Math.log10(this.high)); p++) {
        if (p % skip) continue;
        for (const step of steps) {
          const x = step * 10 ** p;
          if (x >= this.low * 0.9999 && x <= this.high * 1.0001) {
            const [factor, name] = prefixOf(x, this.unit);
            found.push([x, `${Number((x / factor).toPrecision(3))}${name ? " " + name : ""}`]);
          }
        }
      }
      return found;
    }
    const step = niceStep((this.high - this.low) / this.factor / Math.max(count, 1));
    const places = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    const first = Math.ceil(this.low / this.factor / step - 1e-9), last = Math.floor(this.high / this.factor / step + 1e-9);
    for (let k = first; k <= last && found.length < 50; k++) {
      const x = k * step;
      const text = Math.abs(x) >= 1e5 || places > 6 ? digits(x, 3) : x.toFixed(Math.min(places, 6));
      found.push([x * this.factor, text.replace("-", "−")]);
    }
    return found;
  }
}
