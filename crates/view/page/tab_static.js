// Static tab: the path along a port with a marker at the present state.

import { extremes } from "./axes.js";
import { Chart } from "./chart.js";
import { el, fill } from "./dom.js";
import { quantity } from "./units.js";

/** Marks of a path as a chart takes them, with the values at which they stand. */
export function criticalMarks(path, column) {
  return path.critical.map(point => ({ x: point.value, y: column[point.point], text: `${point.name} ${quantity(point.value, path.unit)}` }));
}

/** Panels of a path: one for each unit. */
export function pathPanels(given, marker = null) {
  // of signals that were not chosen, one that is rounding beside the other is left out
  const largest = Math.max(...given.signals.map(signal => Math.max(...signal[2].map(Math.abs))));
  const path = { ...given, signals: given.signals.filter(signal => signal[1] !== "m" || Math.max(...signal[2].map(Math.abs)) > 1e-6 * largest) };
  const units = [...new Set(path.signals.map(signal => signal[1]))];
  return units.map((unit, k) => {
    const own = path.signals.filter(signal => signal[1] === unit);
    const marks = criticalMarks(path, own[0][2]);
    if (marker && k === 0) for (const signal of own) if (Number.isFinite(marker.values[signal[0]])) marks.push({ x: marker.x, y: marker.values[signal[0]], text: "", big: true });
    return { unit, label: own.length === 1 ? own[0][0] : "", curves: own.map(([name, , y]) => ({ name, x: path.values, y, stable: path.stable })), marks };
  });
}

export class StaticTab {
  constructor(page) {
    this.page = page;
    this.id = "static";
    this.title = "Static";
    this.chart = new Chart("path of equilibria");
    this.along = el("select", { "aria-label": "axis of the curve", onchange: () => { this.chosen = this.along.value; this.changed("curve"); } });
    this.colour = el("select", { "aria-label": "colour of the beams", onchange: () => this.page.paint() },
      [["", "one colour"], ["temperature", "temperature"], ["stress", "stress"], ["energy", "strain energy"]].map(([value, text]) => el("option", { value }, text)));
    this.note = el("p", { class: "note", role: "status" });
    this.panel = el("div", { class: "panel" },
      el("div", { class: "row" }, el("label", {}, "curve along ", this.along), el("label", {}, "colour ", this.colour), this.note), this.chart.element);
  }

  describe(description) {
    const loads = description.parameters.filter(p => ["N", "N·m", "N m", "K", "Pa"].includes(p.unit));
    const names = [...description.ports.map(p => p.name), ...loads.map(p => p.name)];
    fill(this.along, names.map(name => el("option", { value: name }, name)));
    const first = description.ports.find(p => p.pull_in_v) ?? description.ports[0] ?? loads[0];
    this.chosen = names.includes(this.chosen) ? this.chosen : first?.name;
    if (this.chosen) this.along.value = this.chosen;
    this.curve = null;
  }

  /** Request of the curve, without what it is along. */
  request() {
    const entry = this.page.entry(this.chosen);
    return entry && { kind: "path", along: this.chosen, from: entry.low, to: entry.high, signals: [] };
  }

  async changed(kind) {
    if (!this.chosen) return this.chart.show({ panels: [], empty: "no port and no load: no curve" });
    const moved = kind === "static" || (kind === "port" && this.page.touched === this.chosen) || (kind === "set" && this.page.touched === this.chosen);
    if (moved && this.curve) return this.draw();
    if (kind === "static") return undefined;
    try {
      const answer = await this.page.latest("curve").ask(this.page.stateWithout(this.chosen), this.request());
      if (answer) this.curve = answer;
      fill(this.note, answer && answer.end !== "arrived" ? `The curve ends before its range does: ${answer.end}.` : "");
    } catch (error) {
      this.curve = null;
      this.chart.show({ panels: [], empty: "" });
      fill(this.note, error.message);
      return undefined;
    }
    return this.draw();
  }

  draw() {
    if (!this.curve) return;
    const still = this.page.static, values = {};
    for (const [name] of this.curve.signals) values[name] = this.page.signal(name);
    const x = this.page.valueOf(this.chosen);
    const marker = still ? { x, values } : null;
    const range = extremes([this.curve.values, [x]]);
    this.chart.show({ x: { label: this.curve.along, unit: this.curve.unit, range }, panels: pathPanels(this.curve, marker), cursor: x });
  }

  shown() {
    this.page.showStatic();
    this.draw();
  }
}
