// Response tab: magnitude in decibels and phase over frequency, with its peaks.

import { Chart } from "./chart.js";
import { el, field, fill } from "./dom.js";
import { digits, netlistNumber, quantity, readNumber } from "./units.js";

export class ResponseTab {
  constructor(page) {
    this.page = page;
    this.id = "response";
    this.title = "Response";
    this.chart = new Chart("frequency response");
    const again = () => this.changed("run");
    this.drive = el("input", { type: "text", list: "bench-drives", onchange: again });
    this.signals = el("input", { type: "text", list: "bench-signals", placeholder: "of the driven place", onchange: again });
    this.from = el("input", { type: "text", class: "number", onchange: again });
    this.to = el("input", { type: "text", class: "number", onchange: again });
    this.drives = el("datalist", { id: "bench-drives" });
    this.words = el("p", { class: "note", role: "status" });
    this.panel = el("div", { class: "panel" },
      el("div", { class: "row" }, field("drive", this.drive, "a port, NODE.fx, NODE.fy, NODE.m, BEAM.T or frame.ax"), field("signals", this.signals), field("from [Hz]", this.from), field("to [Hz]", this.to), this.drives),
      this.words, this.chart.element);
  }

  describe(description) {
    const nodes = description.signals.filter(name => name.endsWith(".x")).map(name => name.slice(0, -2));
    fill(this.drives, [...description.ports.map(p => p.name), "frame.ax", "frame.ay", ...nodes.slice(0, 300).flatMap(node => [`${node}.fx`, `${node}.fy`])].map(value => el("option", { value })));
    this.stale = true;
  }

  defaults() {
    const f = (this.page.frequencies?.frequencies_hz ?? []).filter(hz => hz > 0);
    const round = (x, up) => { const p = 10 ** Math.floor(Math.log10(x)); return (up ? Math.ceil(x / p) : Math.floor(x / p)) * p; };
    if (!this.from.value) this.from.value = netlistNumber(f.length ? round(f[0] / 20, false) : 1e3);
    if (!this.to.value) this.to.value = netlistNumber(f.length ? round(f[f.length - 1] * 2, true) : 1e6);
    if (!this.drive.value) {
      const busiest = this.page.busiest();
      this.drive.value = busiest ? `${busiest.node}.f${busiest.direction}` : this.page.description.ports[0]?.name ?? "frame.ax";
    }
  }

  request() {
    const signals = this.signals.value.trim().split(/\s+/).filter(Boolean);
    return { kind: "response", drive: this.drive.value.trim(), signals, from: readNumber(this.from.value) ?? 1e3, to: readNumber(this.to.value) ?? 1e6, points: 200 };
  }

  async changed(kind) {
    if (kind === "static") return;
    if (this.page.tab !== this) { this.stale = true; return; }
    this.defaults();
    try {
      this.chart.element.classList.add("busy");
      const answer = await this.page.latest("response").ask(this.page.state, this.request());
      if (!answer) return;
      this.answer = answer;
      this.stale = false;
      this.draw();
      this.page.pictured("response");
    } catch (error) {
      this.chart.show({ panels: [], empty: "" });
      fill(this.words, error.message);
    } finally {
      this.chart.element.classList.remove("busy");
    }
  }

  draw() {
    const { frequencies_hz: f, signals, poles, drive_unit: unit } = this.answer;
    const size = v => Math.hypot(v[0] ?? NaN, v[1] ?? NaN);
    const magnitude = signals.map(s => ({ name: `${s.name} [${s.unit}]`, x: f, y: s.values.map(v => 20 * Math.log10(size(v))) }));
    const phase = signals.map(s => {
      let before = null;
      const y = s.values.map(v => {
        let angle = Math.atan2(v[1], v[0]) * 180 / Math.PI;
        if (before !== null && Number.isFinite(angle)) while (angle - before > 180) angle -= 360;
        if (before !== null && Number.isFinite(angle)) while (angle - before < -180) angle += 360;
        if (Number.isFinite(angle)) before = angle;
        return angle;
      });
      return { name: "", x: f, y };
    });
    const peaks = magnitude.flatMap(curve => curve.y.map((y, k) => ({ k, y })).filter(({ k, y }) => k > 0 && k < f.length - 1 && y > curve.y[k - 1] && y >= curve.y[k + 1])
      .sort((a, b) => b.y - a.y).slice(0, 4).map(({ k, y }) => ({ x: f[k], y, text: quantity(f[k], "Hz") })));
    this.chart.show({
      x: { label: "frequency", unit: "Hz", log: true },
      panels: [{ label: "magnitude", unit: "dB", curves: magnitude, marks: peaks }, { label: "phase", unit: "°", curves: phase }],
    });
    const named = poles.slice(0, 6).map(p => `${quantity(p.frequency_hz, "Hz")} (Q ${p.quality === null ? "∞" : digits(p.quality, 3)})`);
    fill(this.words, `0 dB is 1 unit of the signal for 1 ${unit}. ${named.length ? `Resonances: ${named.join(", ")}.` : "No resonance in this band."} ${this.answer.warnings.join(" ")}`);
  }

  shown() {
    this.page.showStatic();
    if (!this.answer || this.stale) this.changed("run");
    else this.draw();
  }
}
