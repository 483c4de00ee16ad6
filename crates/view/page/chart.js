// Charts of curves over one axis, with marks, a cursor and the values under the pointer.

import { Axis, extremes } from "./axes.js";
import { Surface, el, fill, theme } from "./dom.js";
import { quantity } from "./units.js";

const MARGIN = { left: 62, right: 24, top: 12, bottom: 38 };

/**
 * A chart. `show` takes {x: {label, unit, log, range}, panels: [{label, unit, log, curves: [{name, x, y, stable}], marks: [{x, y, text}], bars, lines}], cursor}.
 * Each panel has its own y axis; all share x.
 */
export class Chart {
  constructor(label) {
    this.label = label;
    this.data = null;
    this.pointer = null;
    this.surface = new Surface(label, (context, wide, tall) => this.paint(context, wide, tall));
    this.values = el("output", { class: "values", "aria-live": "off" });
    this.legend = el("div", { class: "legend" });
    this.element = el("div", { class: "chart" }, this.legend, this.surface.box, this.values);
    const canvas = this.surface.canvas;
    canvas.addEventListener("pointermove", event => this.point(event.offsetX));
    canvas.addEventListener("pointerleave", () => this.point(null));
    canvas.addEventListener("click", event => this.xAxis && this.onpick?.(this.xAxis.value(event.offsetX)));
    canvas.addEventListener("keydown", event => {
      if (!this.xAxis || !["ArrowLeft", "ArrowRight"].includes(event.key)) return;
      const middle = (this.xAxis.start + this.xAxis.end) / 2;
      this.point(Math.min(this.xAxis.end, Math.max(this.xAxis.start, (this.pointer ?? middle) + (event.key === "ArrowLeft" ? -4 : 4))));
      event.preventDefault();
    });
  }

  show(data) {
    this.data = data;
    const names = (data?.panels ?? []).flatMap((panel, p) => panel.curves.map((curve, k) => [curve.name, this.colourOf(p, k), curve.dashed]));
    fill(this.legend, names.filter(([name]) => name).map(([name, colour]) => el("span", {}, el("i", { class: `key k${colour}` }), name)));
    this.surface.canvas.setAttribute("aria-label", data ? `${this.label}: ${this.summary()}` : this.label);
    this.surface.refresh();
  }

  setCursor(x) {
    if (this.data) this.data.cursor = x;
    this.surface.refresh();
  }

  colourOf(panel, curve) {
    return (this.data.panels.slice(0, panel).reduce((sum, p) => sum + p.curves.length, 0) + curve) % 6;
  }

  summary() {
    return this.data.panels.flatMap(panel => panel.curves.map(curve => {
      const [low, high] = extremes([curve.y]);
      return `${curve.name || panel.label} from ${quantity(low, panel.unit)} to ${quantity(high, panel.unit)}`;
    })).join("; ");
  }

  point(pixel) {
    this.pointer = pixel;
    this.surface.refresh();
    if (pixel === null || !this.data || !this.xAxis) return fill(this.values);
    const x = this.xAxis.value(Math.min(this.xAxis.end, Math.max(this.xAxis.start, pixel)));
    const parts = [`${this.data.x.label} ${quantity(x, this.data.x.unit)}`];
    for (const panel of this.data.panels) for (const curve of panel.curves) {
      const found = valuesAt(curve, x, this.xAxis.log);
      if (found.length) parts.push(`${curve.name || panel.label} ${found.map(y => quantity(y, panel.unit)).join(" or ")}`);
    }
    fill(this.values, parts.join("  ·  "));
  }

  paint(c, wide, tall) {
    const colours = theme(this.element);
    this.xAxis = null;
    c.font = "12px system-ui, sans-serif";
    if (!this.data || !this.data.panels.length) {
      c.fillStyle = colours.muted;
      c.textAlign = "center";
      c.fillText(this.data?.empty ?? "", wide / 2, tall / 2);
      return;
    }
    const { x, panels } = this.data;
    const [low, high] = x.range ?? extremes(panels.flatMap(panel => panel.curves.map(curve => curve.x)));
    this.xAxis = new Axis(low, high, { ...x, pad: 0 }).over(MARGIN.left, wide - MARGIN.right);
    const room = tall - MARGIN.top - MARGIN.bottom, gap = 14, each = (room - gap * (panels.length - 1)) / panels.length;
    panels.forEach((panel, p) => this.paintPanel(c, colours, panel, p, MARGIN.top + p * (each + gap), each, p === panels.length - 1));
    if (this.pointer !== null) this.line(c, colours.muted, this.pointer, MARGIN.top, tall - MARGIN.bottom, [2, 3]);
    const cursor = this.data.cursor;
    if (cursor !== undefined && cursor !== null) {
      const at = this.xAxis.at(cursor);
      if (at >= MARGIN.left - 1 && at <= wide - MARGIN.right + 1) this.line(c, colours.accent, at, MARGIN.top, tall - MARGIN.bottom, []);
    }
  }

  line(c, colour, x, top, bottom, dash) {
    c.save();
    c.strokeStyle = colour;
    c.lineWidth = 1.2;
    c.setLineDash(dash);
    c.beginPath();
    c.moveTo(x, top);
    c.lineTo(x, bottom);
    c.stroke();
    c.restore();
  }

  paintPanel(c, colours, panel, index, top, height, last) {
    const bottom = top + height, { start, end } = this.xAxis;
    const inside = panel.curves.map(curve => curve.y).concat([(panel.marks ?? []).map(mark => mark.y)], [panel.include ?? []]);
    const [low, high] = extremes(inside);
    const axis = new Axis(low, high, { ...panel, pad: panel.log ? 0 : 0.08 }).over(bottom, top);
    c.lineWidth = 1;
    c.textBaseline = "middle";
    c.textAlign = "right";
    for (const [value, text] of axis.ticks(Math.max(2, height / 42))) {
      const y = axis.at(value);
      c.strokeStyle = colours.grid;
      c.beginPath();
      c.moveTo(start, y);
      c.lineTo(end, y);
      c.stroke();
      c.fillStyle = colours.muted;
      c.fillText(text, start - 6, y);
    }
    c.textBaseline = "top";
    c.textAlign = "center";
    for (const [value, text] of this.xAxis.ticks(Math.max(2, (end - start) / 90))) {
      const x = this.xAxis.at(value);
      c.strokeStyle = colours.grid;
      c.beginPath();
      c.moveTo(x, top);
      c.lineTo(x, bottom);
      c.stroke();
      c.fillStyle = colours.muted;
      if (last) c.fillText(text, x, bottom + 5);
    }
    c.fillStyle = colours.ink;
    if (last) c.fillText(this.xAxis.title, (start + end) / 2, bottom + 21);
    c.save();
    c.translate(12, (top + bottom) / 2);
    c.rotate(-Math.PI / 2);
    c.textBaseline = "middle";
    c.fillText(axis.title, 0, 0, height);
    c.restore();
    c.save();
    c.beginPath();
    c.rect(start, top - 3, end - start, height + 6);
    c.clip();
    for (const bar of panel.bars ?? []) {
      const [a, b, y] = [this.xAxis.at(bar.from), this.xAxis.at(bar.to), axis.at(bar.count)];
      c.fillStyle = bar.bad ? colours.bad : colours.curves[0];
      c.fillRect(a + 0.5, y, Math.max(b - a - 1, 0.5), axis.at(0) - y);
    }
    panel.curves.forEach((curve, k) => this.paintCurve(c, colours.curves[this.colourOf(index, k)], curve, axis));
    c.restore();
    for (const limit of panel.limits ?? []) this.line(c, colours.bad, this.xAxis.at(limit), top, bottom, [6, 3]);
    this.paintMarks(c, colours, panel.marks ?? [], axis, top, bottom);
  }

  paintCurve(c, colour, curve, axis) {
    c.strokeStyle = colour;
    c.lineWidth = 1.8;
    const { x, y, stable } = curve;
    if (!x.length || curve.hidden) return;
    let from = 0;
    const piece = (a, b, dashed) => {
      c.setLineDash(dashed ? [5, 4] : []);
      c.beginPath();
      let open = false;
      for (let k = a; k <= b; k++) {
        const [px, py] = [this.xAxis.at(x[k]), axis.at(y[k])];
        if (!Number.isFinite(px) || !Number.isFinite(py)) open = false;
        else if (open) c.lineTo(px, py);
        else { c.moveTo(px, py); open = true; }
      }
      c.stroke();
    };
    if (!stable) piece(0, x.length - 1, Boolean(curve.dashed));
    else {
      for (let k = 1; k <= x.length; k++) {
        if (k === x.length || stable[k] !== stable[from]) {
          piece(from, Math.min(k, x.length - 1), !stable[from]);
          from = k;
        }
      }
    }
    c.setLineDash([]);
  }

  paintMarks(c, colours, marks, axis, top, bottom) {
    const placed = [];
    c.textBaseline = "middle";
    for (const mark of marks) {
      const x = this.xAxis.at(mark.x), y = axis.at(mark.y);
      if (!Number.isFinite(x) || !Number.isFinite(y) || x < this.xAxis.start - 2 || x > this.xAxis.end + 2) continue;
      c.beginPath();
      c.arc(x, y, mark.big ? 6 : 4, 0, 2 * Math.PI);
      c.fillStyle = mark.big ? colours.accent : colours.ground;
      c.strokeStyle = mark.big ? colours.accent : colours.ink;
      c.lineWidth = 1.6;
      c.fill();
      c.stroke();
      if (!mark.text) continue;
      const width = c.measureText(mark.text).width, right = x + 10 + width < this.xAxis.end;
      let at = Math.min(bottom - 8, Math.max(top + 8, y - 10));
      while (placed.some(([px, py, w]) => Math.abs(py - at) < 14 && Math.abs(px - x) < w + width) && at < bottom - 8) at += 14;
      placed.push([x, at, width]);
      c.textAlign = right ? "left" : "right";
      c.lineWidth = 3;
      c.strokeStyle = colours.ground;
      c.strokeText(mark.text, x + (right ? 9 : -9), at);
      c.fillStyle = colours.ink;
      c.fillText(mark.text, x + (right ? 9 : -9), at);
    }
  }
}

/** Values of a curve at x, one for each branch, at most three. */
export function valuesAt(curve, x, log = false) {
  const found = [];
  for (let k = 1; k < curve.x.length && found.length < 3; k++) {
    const [a, b] = [curve.x[k - 1], curve.x[k]];
    if ((x - a) * (x - b) > 0 || a === b) continue;
    const s = log ? Math.log(x / a) / Math.log(b / a) : (x - a) / (b - a);
    const y = curve.y[k - 1] + s * (curve.y[k] - curve.y[k - 1]);
    if (Number.isFinite(y) && !found.some(other => Math.abs(other - y) <= 1e-9 * Math.abs(y))) found.push(y);
  }
  return found;
}
