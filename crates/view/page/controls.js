// Sliders of parameters and ports.

import { el, fill } from "./dom.js";
import { netlistNumber, quantity, readNumber } from "./units.js";

/** Positions of a slider. */
const STEPS = 400;

/** A slider with a number, a unit and a reset. `changed(value)` is called while it moves. */
export class Slider {
  constructor({ name, about, unit, low, high, value, whole }, changed) {
    Object.assign(this, { name, unit, low, high, initial: value, value, whole });
    const id = `s-${name.replace(/\W/g, "_")}-${Math.random().toString(36).slice(2, 7)}`;
    this.range = el("input", { id, type: "range", min: 0, max: whole ? Math.max(1, Math.round(high - low)) : STEPS, step: 1, oninput: () => { this.set(this.fromPosition()); changed(this.value); } });
    this.number = el("input", {
      type: "text", class: "number", spellcheck: false, "aria-label": `${name}${unit ? ` in ${unit}` : ""}`,
      onchange: () => {
        const typed = readNumber(this.number.value);
        if (typed === null) return this.set(this.value);
        this.set(this.whole ? Math.round(typed) : typed);
        changed(this.value);
        return undefined;
      },
    });
    this.reset = el("button", { type: "button", class: "reset", title: `reset ${name}`, "aria-label": `reset ${name}`, onclick: () => { this.set(this.initial); changed(this.value); } }, "↺");
    this.ends = el("span", { class: "ends" });
    this.element = el("div", { class: "slider", "data-name": name },
      el("label", { for: id, title: about || "" }, el("b", {}, name), el("small", {}, about || "")), this.number, el("span", { class: "unit" }, unit), this.reset, this.range, this.ends);
    this.set(value);
  }

  fromPosition() {
    const s = Number(this.range.value) / Number(this.range.max), x = this.low + s * (this.high - this.low);
    if (this.whole) return Math.round(x);
    // a number with few digits, which a link and a command line can have
    const step = 10 ** Math.floor(Math.log10((this.high - this.low) / STEPS));
    return Number((Math.round(x / step) * step).toPrecision(8));
  }

  set(value) {
    this.value = value;
    [this.low, this.high] = [Math.min(this.low, value), Math.max(this.high, value)];
    this.range.value = Math.round((value - this.low) / (this.high - this.low || 1) * Number(this.range.max));
    this.range.setAttribute("aria-valuetext", quantity(value, this.unit));
    this.number.value = netlistNumber(value);
    this.reset.disabled = value === this.initial;
    fill(this.ends, `${netlistNumber(this.low)} … ${netlistNumber(this.high)}`);
    this.element.classList.toggle("changed", value !== this.initial);
  }
}

/** The panel of all sliders. */
export class Controls {
  constructor(changedParameter, changedPort) {
    this.changedParameter = changedParameter;
    this.changedPort = changedPort;
    this.sliders = new Map();
    this.list = el("div", {});
    this.element = el("section", { class: "controls", "aria-label": "parameters and ports" }, this.list);
  }

  show(description, state, live) {
    this.sliders.clear();
    const sliders = (heading, list, kind, changed) => {
      if (!list.length) return [];
      const made = list.map(entry => {
        if (entry.text !== undefined) return this.textField(entry, changed);
        const slider = new Slider({ ...entry, value: entry.value ?? 0 }, value => changed(entry.name, value));
        slider.set(state[kind][entry.name] ?? slider.initial);
        this.sliders.set(`${kind}:${entry.name}`, slider);
        if (!live) [slider.range, slider.number, slider.reset].forEach(input => { input.disabled = true; });
        return slider.element;
      });
      return [el("h2", {}, heading), ...made];
    };
    const ports = description.ports.map(port => ({ ...port, value: description.initial_ports[port.name] ?? 0, about: port.pull_in_v ? "" : "" }));
    const parts = [...sliders("Ports", ports, "ports", this.changedPort), ...sliders("Parameters", description.parameters, "set", this.changedParameter)];
    fill(this.list, parts.length ? parts : el("p", { class: "note" }, "This netlist has no port and no param. Write `param w = 2u` in it to get a slider."));
  }

  textField(entry, changed) {
    const input = el("input", { type: "text", value: entry.text, spellcheck: false, onchange: () => changed(entry.name, input.value) });
    return el("label", { class: "field", title: entry.about || "" }, el("span", {}, entry.name), input);
  }

  set(kind, name, value) {
    this.sliders.get(`${kind}:${name}`)?.set(value);
  }
}
