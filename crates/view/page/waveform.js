// Waveforms of ports: typed as in a deck, or drawn.

import { Axis, extremes } from "./axes.js";
import { Surface, el, fill, theme } from "./dom.js";
import { netlistNumber, quantity, readNumber } from "./units.js";

/** Corners of one period of a sinusoid. */
const SAMPLES = 48;
const MAX_CORNERS = 8000;

/** Corners [t, volts] of a waveform until `stop`: a number, PULSE(v1 v2 td tr tf pw per), SIN(vo va freq td), or PWL(t1 v1 …). Throws with a sentence. */
export function corners(text, stop) {
  const constant = readNumber(text);
  if (constant !== null) return [[0, constant]];
  const match = /^\s*(pulse|sin|pwl)\s*\(([^)]*)\)\s*$/i.exec(text);
  if (!match) throw new Error("expected volts, PULSE(v1 v2 delay rise fall width period), SIN(offset amplitude hertz) or PWL(t1 v1 t2 v2 …)");
  const values = match[2].trim().split(/[\s,]+/).map(readNumber);
  if (values.some(x => x === null)) throw new Error("a value is no number: expected such as 2.2, 10u or 1.5k");
  const kind = match[1].toLowerCase();
  if (kind === "pwl") return pieces(values);
  return kind === "sin" ? sinusoid(values, stop) : pulses(values, stop);
}

function pieces(values) {
  if (values.length < 2 || values.length % 2) throw new Error("expected pairs of time and volts in PWL");
  const found = [];
  for (let k = 0; k < values.length; k += 2) found.push([values[k], values[k + 1]]);
  if (found.some(([t], k) => k && t <= found[k - 1][0])) throw new Error("expected ascending times in PWL");
  return found;
}

function sinusoid([offset = 0, amplitude = 0, frequency, delay = 0], stop) {
  const f = frequency || 1 / stop, found = [[0, offset]];
  const count = Math.ceil((stop - delay) * f * SAMPLES);
  if (count > MAX_CORNERS) throw new Error(`${Math.round((stop - delay) * f)} periods are more than the page computes: lower the frequency or the end time`);
  for (let k = delay > 0 ? 0 : 1; k <= count; k++) found.push([delay + k / (f * SAMPLES), offset + amplitude * Math.sin(2 * Math.PI * k / SAMPLES)]);
  return found;
}

function pulses([v1 = 0, v2 = 0, delay = 0, rise, fall, width, period], stop) {
  const up = rise || stop / 1000, down = fall || up, on = width ?? stop, each = period || 2 * stop + up + on + down;
  if (each < up + on + down) throw new Error("the period of PULSE is shorter than rise, width and fall");
  if ((stop - delay) / each * 4 > MAX_CORNERS) throw new Error("there are more pulses than the page computes: lengthen the period or shorten the end time");
  const found = [[0, v1]], add = (t, v) => { if (t > found[found.length - 1][0]) found.push([t, v]); else found[found.length - 1] = [found[found.length - 1][0], v]; };
  for (let t = delay; t <= stop; t += each) {
    add(t, v1);
    add(t + up, v2);
    add(t + up + on, v2);
    add(t + up + on + down, v1);
  }
  return found;
}

/** Field and drawing of the waveform of one port. `changed` is called after each valid change. */
export class WaveEditor {
  constructor(port, text, stop, changed) {
    this.port = port;
    this.stop = stop;
    this.changed = changed;
    this.input = el("input", { type: "text", value: text, spellcheck: false, "aria-label": `waveform of ${port} in volts`, onchange: () => this.read(true) });
    this.message = el("p", { class: "field-error", role: "alert" });
    this.surface = new Surface(`waveform of ${port}; click to draw corners`, (c, wide, tall) => this.paint(c, wide, tall));
    this.surface.canvas.addEventListener("click", event => this.drawCorner(event.offsetX, event.offsetY));
    this.element = el("div", { class: "wave" }, el("label", { class: "field" }, el("span", {}, `${port} [V]`), this.input), this.surface.box, this.message);
    this.read(false);
  }

  setStop(stop) {
    this.stop = stop;
    this.read(false);
  }

  read(announce) {
    try {
      this.corners = corners(this.input.value, this.stop());
      fill(this.message);
      this.input.removeAttribute("aria-invalid");
    } catch (error) {
      this.corners = null;
      fill(this.message, error.message);
      this.input.setAttribute("aria-invalid", "true");
    }
    this.surface.refresh();
    if (announce && this.corners) this.changed();
  }

  get constant() {
    return readNumber(this.input.value);
  }

  paint(c, wide, tall) {
    const colours = theme(this.element), stop = this.stop();
    c.strokeStyle = colours.grid;
    c.strokeRect(0.5, 0.5, wide - 1, tall - 1);
    if (!this.corners) return;
    const shown = [[0, this.corners[0][1]], ...this.corners, [stop, this.corners[this.corners.length - 1][1]]].filter(([t]) => t <= stop);
    const [low, high] = extremes([shown.map(p => p[1]), [0]]);
    this.xAxis = new Axis(0, stop, { pad: 0 }).over(4, wide - 4);
    this.yAxis = new Axis(low, high > low ? high : low + 1, { pad: 0.15 }).over(tall - 4, 4);
    c.strokeStyle = colours.curves[0];
    c.lineWidth = 1.6;
    c.beginPath();
    shown.forEach(([t, v], k) => (k ? c.lineTo(this.xAxis.at(t), this.yAxis.at(v)) : c.moveTo(this.xAxis.at(t), this.yAxis.at(v))));
    c.stroke();
    if (this.corners.length < 40) for (const [t, v] of this.corners) {
      c.fillStyle = colours.curves[0];
      c.fillRect(this.xAxis.at(t) - 2, this.yAxis.at(v) - 2, 4, 4);
    }
    c.fillStyle = colours.muted;
    c.font = "11px system-ui, sans-serif";
    c.textAlign = "right";
    c.fillText(quantity(stop, "s", 3), wide - 6, tall - 7);
    c.textAlign = "left";
    c.fillText(quantity(high, "V", 3), 6, 14);
  }

  /** Adds a corner where the drawing was clicked, or takes away the one there. */
  drawCorner(px, py) {
    if (!this.xAxis) return;
    let list = this.corners && this.corners.length < 40 ? this.corners.slice() : [[0, 0]];
    const near = list.findIndex(([t, v]) => Math.hypot(this.xAxis.at(t) - px, this.yAxis.at(v) - py) < 8);
    if (near > 0) list.splice(near, 1);
    else {
      list = list.filter(([t]) => Math.abs(this.xAxis.at(t) - px) > 3);
      list.push([Math.max(0, this.xAxis.value(px)), this.yAxis.value(py)]);
      list.sort((a, b) => a[0] - b[0]);
    }
    this.input.value = `PWL(${list.map(([t, v]) => `${netlistNumber(Number(t.toPrecision(3)))} ${netlistNumber(Number(v.toPrecision(3)))}`).join(" ")})`;
    this.read(true);
  }
}
