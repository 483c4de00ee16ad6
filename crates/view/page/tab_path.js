// Path tab: equilibria along a port, a parameter or all loads, with stable and unstable branches.

import { Chart } from "./chart.js";
import { el, field, fill } from "./dom.js";
import { pathPanels } from "./tab_static.js";
import { netlistNumber, quantity, readNumber } from "./units.js";

export class PathTab {
  constructor(page) {
    this.page = page;
    this.id = "path";
    this.title = "Path";
    this.chart = new Chart("path of equilibria");
    this.along = el("select", { onchange: () => { this.range(); this.changed("path"); } });
    this.from = el("input", { type: "text", class: "number", onchange: () => this.changed("path") });
    this.to = el("input", { type: "text", class: "number", onchange: () => this.changed("path") });
    this.signals = el("input", { type: "text", list: "bench-signals", placeholder: "x and y of the node that moves most", onchange: () => this.changed("path") });
    this.words = el("p", { class: "note", role: "status" });
    this.panel = el("div", { class: "panel" },
      el("div", { class: "row" }, field("along", this.along), field("from", this.from), field("to", this.to), field("signals", this.signals, "names of signals, separated by blanks")),
      this.words, this.chart.element);
  }

  describe(description) {
    const names = [...description.ports.map(p => p.name), ...description.parameters.filter(p => p.value !== undefined).map(p => p.name), "loads"];
    const before = this.along.value;
    fill(this.along, names.map(name => el("option", { value: name }, name)));
    this.along.value = names.includes(before) ? before : this.page.tabs[0].chosen ?? "loads";
    if (before !== this.along.value) this.range();
  }

  range() {
    const entry = this.page.entry(this.along.value) ?? { low: 0, high: 1 };
    this.from.value = netlistNumber(entry.low < 0 && entry.value === 0 ? 0 : entry.low);
    this.to.value = netlistNumber(entry.high);
  }

  request() {
    const signals = this.signals.value.trim().split(/\s+/).filter(Boolean);
    return { kind: "path", along: this.along.value, from: readNumber(this.from.value) ?? 0, to: readNumber(this.to.value) ?? 1, signals };
  }

  async changed(kind) {
    if (this.page.tab !== this || kind === "static") { if (kind !== "static") this.stale = true; return; }
    if (kind !== "path" && this.page.touched === this.along.value) return this.draw();
    try {
      this.chart.element.classList.add("busy");
      const answer = await this.page.latest("path").ask(this.page.stateWithout(this.along.value), this.request());
      if (!answer) return;
      this.answer = answer;
      this.stale = false;
      this.draw();
      this.page.pictured("path");
    } catch (error) {
      this.answer = null;
      this.chart.show({ panels: [], empty: "" });
      fill(this.words, error.message);
    } finally {
      this.chart.element.classList.remove("busy");
    }
  }

  draw() {
    const path = this.answer;
    if (!path) return;
    const named = path.critical.map(point => `${point.name} at ${quantity(point.value, path.unit)}`);
    const end = path.end === "arrived" ? "" : `The path ends: ${path.end}.`;
    fill(this.words, [named.length ? `${named.join(", ")}.` : "No limit point and no bifurcation.", "Solid: stable. Dashed: unstable.", end, ...path.warnings].join(" "));
    this.chart.show({ x: { label: path.along, unit: path.unit }, panels: pathPanels(path), cursor: this.page.valueOf(this.along.value) });
  }

  shown() {
    this.page.showStatic();
    if (!this.answer || this.stale) this.changed("path");
    else this.draw();
  }
}
