// Circuit tab: a deck of the device, run by ngspice. Yield tab: samples of parameters against limits.

import { niceStep } from "./axes.js";
import { Chart } from "./chart.js";
import { el, field, fill } from "./dom.js";
import { netlistNumber, quantity, readNumber } from "./units.js";

export class CircuitTab {
  constructor(page) {
    this.page = page;
    this.id = "circuit";
    this.title = "Circuit";
    this.chart = new Chart("waveforms of the circuit");
    this.deck = el("select", {});
    this.run = el("button", { type: "button", onclick: () => this.start() }, "Run ngspice");
    this.stop = el("button", { type: "button", onclick: () => this.page.latest("circuit").stop() }, "Stop");
    this.picks = el("div", { class: "checks" });
    this.note = el("p", { class: "note", role: "status" });
    this.text = el("pre", { class: "deck" });
    this.panel = el("div", { class: "panel" },
      el("div", { class: "row" }, field("deck", this.deck), this.run, this.stop, this.note), this.picks, this.chart.element,
      el("details", {}, el("summary", {}, "deck"), this.text));
  }

  describe(description) {
    fill(this.deck, description.decks.map(name => el("option", { value: name }, name)));
    const none = !description.decks.length;
    this.run.disabled = this.stop.disabled = none || !this.page.transport.live;
    if (none) fill(this.note, "No deck (.cir) beside the netlist names it. `bimorph cosim FILE.net --emit FILE.cir` writes one.");
  }

  request() {
    return { kind: "circuit", deck: this.deck.value };
  }

  async start() {
    fill(this.note, "ngspice runs …");
    this.chart.element.classList.add("busy");
    try {
      const answer = await this.page.latest("circuit").ask(this.page.state, this.request());
      if (!answer) return fill(this.note, "stopped");
      this.receive(answer);
      this.page.pictured("circuit");
    } catch (error) {
      fill(this.note, error.message);
    } finally {
      this.chart.element.classList.remove("busy");
    }
    return undefined;
  }

  receive(answer) {
    this.answer = answer;
    const [first, ...rest] = answer.columns;
    fill(this.note, `${answer.plot}: ${first.values.length} points. The deck uses the file on disk with its own values. ${answer.warnings.join(" ")}`);
    fill(this.text, answer.text);
    const usual = rest.filter(c => !c.name.includes("#")).slice(0, 4);
    this.chosen = new Set(usual.map(c => c.name));
    fill(this.picks, rest.map(column => el("label", {}, el("input", {
      type: "checkbox", checked: this.chosen.has(column.name),
      onchange: event => { if (event.target.checked) this.chosen.add(column.name); else this.chosen.delete(column.name); this.draw(); },
    }), column.name)));
    this.draw();
  }

  draw() {
    if (!this.answer) return;
    const [first, ...rest] = this.answer.columns, shown = rest.filter(c => this.chosen.has(c.name)).slice(0, 6);
    this.chart.show({
      x: { label: first.name, unit: first.unit, log: this.answer.complex },
      panels: shown.map(c => ({ unit: c.unit, label: c.name, curves: [{ name: c.name, x: first.values, y: c.values }] })),
    });
  }

  async changed() {}

  shown() {
    this.page.showStatic();
    if (!this.page.transport.live && !this.answer) this.start();
    else this.draw();
  }
}

export class YieldTab {
  constructor(page) {
    this.page = page;
    this.id = "yield";
    this.title = "Yield";
    this.chart = new Chart("histogram of samples");
    this.spreads = el("div", { class: "spreads" });
    this.analysis = el("select", { onchange: () => this.limits() }, [["static", "a signal"], ["modes", "first frequency"], ["pullin", "pull-in voltage"]].map(([value, text]) => el("option", { value }, text)));
    this.signal = el("input", { type: "text", list: "bench-signals" });
    this.count = el("input", { type: "number", min: 2, max: 100000, value: 400 });
    this.seed = el("input", { type: "number", min: 0, value: 1 });
    this.low = el("input", { type: "text", class: "number", placeholder: "none" });
    this.high = el("input", { type: "text", class: "number", placeholder: "none" });
    this.run = el("button", { type: "button", onclick: () => this.start() }, "Run samples");
    this.stop = el("button", { type: "button", onclick: () => this.page.latest("yield").stop() }, "Stop");
    this.worst = el("button", { type: "button", disabled: true, onclick: () => this.putWorst() }, "Put the worst sample on the bench");
    this.progress = el("progress", { max: 1, value: 0, hidden: true, "aria-label": "samples" });
    this.words = el("div", { class: "note", role: "status" });
    this.panel = el("div", { class: "panel" },
      el("div", { class: "row" }, field("result", this.analysis), field("signal", this.signal), field("at least", this.low), field("at most", this.high), field("samples", this.count), field("seed", this.seed)),
      this.spreads, el("div", { class: "row" }, this.run, this.stop, this.worst, this.progress), this.words, this.chart.element);
  }

  describe(description) {
    const numbers = description.parameters.filter(p => p.value !== undefined && p.value !== 0 && !p.whole);
    this.rows = numbers.map((p, k) => {
      const known = this.rows?.find(row => row.name === p.name);
      return { name: p.name, unit: p.unit, input: el("input", { type: "text", class: "number", value: known?.input.value ?? (k < 3 ? "3" : "0"), "aria-label": `standard deviation of ${p.name} in percent` }) };
    });
    fill(this.spreads, this.rows.length ? [el("span", {}, "standard deviations in %: "), this.rows.map(row => el("label", { class: "field" }, el("span", {}, row.name), row.input))] : "no parameter with a value varies: write `param w = 2u` in the netlist");
    this.run.disabled = this.stop.disabled = !this.page.transport.live || !this.rows.length;
  }

  limits() {
    [this.low.value, this.high.value] = ["", ""];
    this.signal.disabled = this.analysis.value !== "static";
  }

  /** Name of the result in the table of the sweep. */
  result() {
    return { static: this.signal.value.trim(), modes: "f1", pullin: "pull_in" }[this.analysis.value];
  }

  request() {
    const vary = this.rows.map(row => [row, readNumber(row.input.value)]).filter(([, percent]) => percent > 0)
      .map(([row, percent]) => { const x = this.page.valueOf(row.name); return `${row.name}=normal:${x}:${Math.abs(x) * percent / 100}`; });
    const name = this.result(), limit = (input, sign) => { const x = readNumber(input.value); return x === null ? [] : [`${name}${sign}${x}`]; };
    return {
      kind: "yield", vary, samples: Number(this.count.value) || 400, seed: Number(this.seed.value) || 0, analysis: this.analysis.value, signal: this.signal.value.trim(),
      limits: [...limit(this.low, ">="), ...limit(this.high, "<=")],
    };
  }

  async start() {
    const asked = this.request();
    if (!asked.vary.length) return fill(this.words, "give at least one standard deviation above 0");
    this.progress.hidden = false;
    this.progress.value = 0;
    this.chart.element.classList.add("busy");
    try {
      const answer = await this.page.latest("yield").ask(this.page.state, asked);
      if (!answer) return fill(this.words, "stopped");
      this.answer = { ...answer, low: readNumber(this.low.value), high: readNumber(this.high.value) };
      this.draw();
      this.page.pictured("yield");
    } catch (error) {
      fill(this.words, error.message);
    } finally {
      this.progress.hidden = true;
      this.chart.element.classList.remove("busy");
    }
    return undefined;
  }

  /** The sample farthest beyond the limits, or farthest from the mean. */
  worstRow() {
    const { rows, columns, low, high } = this.answer, mean = columns?.[0]?.mean ?? 0;
    const badness = value => (low === null && high === null ? Math.abs(value - mean) : Math.max(low === null ? -Infinity : low - value, high === null ? -Infinity : value - high));
    const known = rows.filter(row => row[1] !== null);
    return known.reduce((worst, row) => (worst === null || badness(row[1]) > badness(worst[1]) ? row : worst), null);
  }

  putWorst() {
    const worst = this.worstRow();
    if (!worst) return;
    const set = {};
    this.answer.parameters.forEach((name, k) => { set[name] = worst[0][k]; });
    this.page.setParameters(set);
    fill(this.words, `On the bench: ${this.answer.parameters.map((name, k) => `${name} = ${netlistNumber(worst[0][k])}`).join(", ")}.`);
  }

  draw() {
    if (!this.answer) return;
    const { rows, columns, results, passed, low, high } = this.answer, values = rows.map(row => row[1]).filter(x => x !== null);
    const failed = rows.filter(row => row[2]), unit = results[0]?.[1] ?? "";
    this.worst.disabled = !values.length || !this.page.transport.live;
    if (!values.length) return fill(this.words, failed[0]?.[2] ?? "no sample has a result");
    const least = Math.min(...values), most = Math.max(...values), step = niceStep((most - least || Math.abs(least) || 1) / Math.min(40, 2 + Math.sqrt(values.length)));
    const bars = new Map();
    for (const x of values) bars.set(Math.floor(x / step), (bars.get(Math.floor(x / step)) ?? 0) + 1);
    const bad = k => (low !== null && (k + 0.5) * step < low) || (high !== null && (k + 0.5) * step > high);
    const list = [...bars].map(([k, count]) => ({ from: k * step, to: (k + 1) * step, count, bad: bad(k) }));
    const ends = [Math.min(least, low ?? least), Math.max(most, high ?? most)], room = 0.04 * (ends[1] - ends[0]) || step;
    this.chart.show({
      x: { label: results[0][0], unit, range: [ends[0] - room, ends[1] + room] },
      panels: [{ label: "samples", unit: "", curves: [{ name: "", x: [ends[0], ends[1]], y: [0, Math.max(...bars.values())], hidden: true }], bars: list, limits: [low, high].filter(x => x !== null) }],
    });
    const c = columns[0], share = passed && (low !== null || high !== null);
    fill(this.words, [
      `mean ${quantity(c.mean, unit)}`, `standard deviation ${quantity(c.deviation, unit)}`, `5 % to 95 %: ${quantity(c.percentiles[0], unit)} to ${quantity(c.percentiles[2], unit)}`,
      ...(share ? [`yield ${(100 * passed.passed / passed.points).toFixed(1)} % (95 % interval ${passed.interval.map(x => (100 * x).toFixed(1)).join(" to ")} %)`] : []),
      ...(failed.length ? [`${failed.length} without a result: ${failed[0][2]}`] : []),
    ].join("  ·  "));
    return undefined;
  }

  async changed() {}

  shown() {
    this.page.showStatic();
    if (!this.signal.value) {
      const busiest = this.page.busiest();
      this.signal.value = busiest ? `${busiest.node}.${busiest.direction}` : "";
    }
    if (!this.page.transport.live && !this.answer) this.start();
    else this.draw();
  }
}
