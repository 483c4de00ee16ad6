// Modes tab: shapes in motion, frequency and Q.

import { el, fill, field } from "./dom.js";
import { quantity, digits } from "./units.js";

/** Periods in a second of the slowest picture. */
const SPEED = 1.1;

export class ModesTab {
  constructor(page) {
    this.page = page;
    this.id = "modes";
    this.title = "Modes";
    this.mode = 0;
    this.playing = true;
    this.phase = Math.PI / 2;
    this.count = el("input", { type: "number", min: 1, max: 40, value: 6, onchange: () => this.changed("set") });
    this.size = el("input", { type: "range", min: 1, max: 30, value: 6, "aria-label": "amplitude of the shape" });
    this.play = el("button", { type: "button", onclick: () => this.setPlaying(!this.playing) }, "Pause");
    this.list = el("tbody", {});
    this.note = el("p", { class: "note", role: "status" });
    this.panel = el("div", { class: "panel scroll" },
      el("div", { class: "row" }, this.play, field("amplitude", this.size), field("modes", this.count), this.note),
      el("table", { class: "picks" }, el("thead", {}, el("tr", {}, ["mode", "frequency", "Q", "error"].map(text => el("th", { scope: "col" }, text)))), this.list));
  }

  setPlaying(playing) {
    this.playing = playing;
    fill(this.play, playing ? "Pause" : "Play");
    if (playing) this.tick();
    else this.frame();
  }

  request() {
    return { kind: "modes", count: Math.min(40, Math.max(1, Number(this.count.value) || 6)), shapes: true };
  }

  async changed(kind) {
    if (kind === "static" || this.page.tab !== this) { this.stale = true; return; }
    try {
      const answer = await this.page.latest("modes").ask(this.page.state, this.request());
      if (!answer) return;
      this.answer = answer;
      this.stale = false;
      this.mode = Math.min(this.mode, answer.frequencies_hz.length - 1);
      fill(this.note, answer.warnings.join(" "));
      this.rows();
      this.page.figure.show(answer, this.shape());
      this.page.pictured("modes");
    } catch (error) {
      fill(this.note, error.message);
    }
  }

  rows() {
    const { frequencies_hz: f, qualities: q, errors } = this.answer;
    fill(this.list, f.map((hz, k) => el("tr", { class: k === this.mode ? "chosen" : "" },
      el("td", {}, el("button", { type: "button", "aria-pressed": String(k === this.mode), onclick: () => this.choose(k) }, `mode ${k + 1}`)),
      el("td", {}, quantity(hz, "Hz")), el("td", {}, q ? (q[k] === null ? "undamped" : digits(q[k])) : "–"), el("td", {}, errors[k] === null ? "–" : errors[k].toExponential(1)))));
  }

  choose(k) {
    this.mode = k;
    this.rows();
    this.frame();
  }

  /** The shape, its largest displacement 1 % of the size of the mechanism. */
  shape() {
    const { frames } = this.answer.arrays, each = frames.length / this.answer.frequencies_hz.length;
    const shape = frames.slice(this.mode * each, (this.mode + 1) * each);
    const [x0, y0, x1, y1] = this.answer.figure.bounds, size = Math.max(x1 - x0, y1 - y0);
    let largest = 1e-30;
    for (let i = 0; i < shape.length; i += 3) largest = Math.max(largest, Math.hypot(shape[i], shape[i + 1]));
    return shape.map(x => x * 0.01 * size / largest);
  }

  frame() {
    if (!this.answer || this.page.tab !== this) return;
    const figure = this.page.figure;
    figure.fixedFactor = 1;
    figure.shape = true;
    figure.caption = `mode ${this.mode + 1}: ${quantity(this.answer.frequencies_hz[this.mode], "Hz")}`;
    figure.move(this.shape(), Number(this.size.value) * Math.sin(this.phase));
  }

  tick(now = performance.now()) {
    if (!this.playing || this.page.tab !== this || !this.page.visible) { this.running = false; return; }
    if (this.last && now > this.last) this.phase += Math.min(now - this.last, 100) / 1000 * 2 * Math.PI * SPEED;
    this.last = now;
    this.frame();
    this.running = true;
    requestAnimationFrame(next => this.tick(next));
  }

  shown() {
    if (!this.answer || this.stale) this.changed("set");
    else this.page.figure.show(this.answer, this.shape());
    this.page.figure.paintBy(null);
    if (!this.running) { this.last = 0; this.tick(); }
    if (!this.playing) this.frame();
  }
}
