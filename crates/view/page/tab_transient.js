// Transient tab: waveforms of the ports, signals over time, and the moving mechanism under a scrub bar.

import { Chart } from "./chart.js";
import { el, field, fill } from "./dom.js";
import { netlistNumber, quantity, readNumber } from "./units.js";
import { WaveEditor } from "./waveform.js";

/** Time of the whole picture in motion [s]. */
const SHOWN = 6;

export class TransientTab {
  constructor(page) {
    this.page = page;
    this.id = "transient";
    this.title = "Transient";
    this.chart = new Chart("signals over time");
    this.chart.onpick = t => { this.setPlaying(false); this.seek(t); };
    this.stop = el("input", { type: "text", class: "number", onchange: () => { this.waves.forEach(wave => wave.read(false)); this.changed("run"); } });
    this.points = el("input", { type: "number", min: 50, max: 20000, value: 500, onchange: () => this.changed("run") });
    this.signals = el("input", { type: "text", list: "bench-signals", placeholder: "of the node that moves most", onchange: () => this.changed("run") });
    this.waveBox = el("div", { class: "waves" });
    this.waves = [];
    this.play = el("button", { type: "button", onclick: () => this.setPlaying(!this.playing) }, "Play");
    this.scrub = el("input", { type: "range", min: 0, max: 1000, value: 0, class: "scrub", "aria-label": "time", oninput: () => { this.setPlaying(false); this.seek(this.end() * this.scrub.value / 1000); } });
    this.clock = el("output", { class: "clock" });
    this.note = el("p", { class: "note", role: "status" });
    this.panel = el("div", { class: "panel" },
      el("div", { class: "row" }, field("until [s]", this.stop), field("times", this.points), field("signals", this.signals, "names of signals, separated by blanks"), this.note),
      this.waveBox, el("div", { class: "row" }, this.play, this.scrub, this.clock), this.chart.element);
  }

  describe(description) {
    const before = new Map(this.waves.map(wave => [wave.port, wave.input.value]));
    const stop = () => readNumber(this.stop.value) || 1e-4;
    this.waves = description.ports.map(port => new WaveEditor(port.name, before.get(port.name) ?? netlistNumber(this.page.state.ports[port.name] ?? 0), stop, () => this.changed("run")));
    fill(this.waveBox, this.waves.map(wave => wave.element));
    this.stale = true;
  }

  /** End time: some periods of the first mode, or some time constants of heat. */
  defaultStop() {
    if (this.stop.value) return;
    const f = this.page.frequencies?.frequencies_hz?.find(hz => hz > 0);
    const heated = this.page.static?.temperatures_k.length > 0;
    this.stop.value = netlistNumber(Number((heated ? 1e-3 : f ? 20 / f : 1e-4).toPrecision(1)));
    this.waves.forEach(wave => wave.read(false));
  }

  request() {
    const waves = {};
    for (const wave of this.waves) if (wave.constant === null && wave.corners) waves[wave.port] = wave.corners;
    const signals = this.signals.value.trim().split(/\s+/).filter(Boolean);
    return { kind: "transient", stop: readNumber(this.stop.value) || 1e-4, points: Math.max(2, Number(this.points.value) || 500), signals, waves };
  }

  state() {
    const ports = { ...this.page.state.ports };
    for (const wave of this.waves) if (wave.constant !== null) ports[wave.port] = wave.constant;
    return { ...this.page.state, ports };
  }

  async changed(kind) {
    if (kind === "port") for (const wave of this.waves) {
      if (wave.port === this.page.touched && wave.constant !== null) { wave.input.value = netlistNumber(this.page.state.ports[wave.port]); wave.read(false); }
    }
    if (kind === "static") return;
    if (this.page.tab !== this) { this.stale = true; return; }
    this.defaultStop();
    if (this.waves.some(wave => !wave.corners)) return;
    try {
      this.chart.element.classList.add("busy");
      const answer = await this.page.latest("transient").ask(this.state(), this.request());
      if (!answer) return;
      this.answer = answer;
      this.stale = false;
      const units = [...new Set(answer.signals.map(signal => signal[1]))];
      const panels = units.map(unit => {
        const own = answer.signals.filter(signal => signal[1] === unit);
        return { unit, label: own.length === 1 ? own[0][0] : "", curves: own.map(([name, , y]) => ({ name, x: answer.t, y })) };
      });
      this.chart.show({ x: { label: "time", unit: "s", range: [0, this.end()] }, panels, cursor: 0 });
      fill(this.note, answer.warnings.join(" "));
      this.showFrames();
      this.page.pictured("transient");
    } catch (error) {
      fill(this.note, error.message);
    } finally {
      this.chart.element.classList.remove("busy");
    }
  }

  end() {
    return this.answer ? this.answer.t[this.answer.t.length - 1] : 1;
  }

  showFrames() {
    const figure = this.page.figure;
    this.each = this.answer.arrays.frames.length / this.answer.frame_times.length;
    figure.caption = "";
    figure.fixedFactor = null;
    // one factor for the whole motion
    figure.show(this.answer, this.largestFrame());
    figure.fixedFactor = figure.exaggeration ?? figure.factor();
    this.seek(this.at ?? 0);
    this.setPlaying(true);
  }

  frameAt(k) {
    return this.answer.arrays.frames.subarray(k * this.each, (k + 1) * this.each);
  }

  largestFrame() {
    let best = 0, most = -1;
    for (let k = 0; k < this.answer.frame_times.length; k++) {
      const frame = this.frameAt(k);
      let far = 0;
      for (let i = 0; i < frame.length; i += 3) far = Math.max(far, Math.hypot(frame[i], frame[i + 1]));
      if (far > most) [best, most] = [k, far];
    }
    return this.frameAt(best);
  }

  seek(t) {
    if (!this.answer) return;
    this.at = Math.min(Math.max(t, 0), this.end());
    const times = this.answer.frame_times;
    let k = times.findIndex(time => time > this.at);
    if (k < 1) k = k === 0 ? 1 : times.length - 1;
    const s = Math.min(1, Math.max(0, (this.at - times[k - 1]) / (times[k] - times[k - 1] || 1))), a = this.frameAt(k - 1), b = this.frameAt(k);
    this.page.figure.move(a.map((x, i) => x + s * (b[i] - x)));
    this.scrub.value = Math.round(1000 * this.at / this.end());
    fill(this.clock, quantity(this.at, "s"));
    this.scrub.setAttribute("aria-valuetext", quantity(this.at, "s"));
    this.chart.setCursor(this.at);
  }

  setPlaying(playing) {
    this.playing = playing;
    fill(this.play, playing ? "Pause" : "Play");
    if (playing && !this.running) { this.last = 0; this.tick(); }
  }

  tick(now = performance.now()) {
    if (!this.playing || !this.answer || this.page.tab !== this || !this.page.visible) { this.running = false; return; }
    this.running = true;
    if (this.last) {
      const next = this.at + Math.min(now - this.last, 100) / 1000 / SHOWN * this.end();
      this.seek(next);
      // it plays once: a page that is left alone comes to rest
      if (next >= this.end()) { this.setPlaying(false); this.at = 0; this.running = false; return; }
    }
    this.last = now;
    requestAnimationFrame(next => this.tick(next));
  }

  shown() {
    this.page.figure.paintBy(null);
    if (!this.answer || this.stale) { this.page.showStatic(); this.changed("run"); }
    else this.showFrames();
  }
}
