// The page: the mechanism with its sliders, tabs and readings.

import { Controls } from "./controls.js";
import { debounced, el, fill, table } from "./dom.js";
import { Editor } from "./editor.js";
import { Figure } from "./figure.js";
import { CircuitTab, YieldTab } from "./tab_more.js";
import { ModesTab } from "./tab_modes.js";
import { PathTab } from "./tab_path.js";
import { ResponseTab } from "./tab_response.js";
import { StaticTab } from "./tab_static.js";
import { TransientTab } from "./tab_transient.js";
import { Latest, RecordedTransport, Transport, WidgetTransport } from "./transport.js";
import { digits, quantity } from "./units.js";

/** Modes that every state shows. */
const FIRST_MODES = 3;
/** Pause after the last change before analyses beside statics run [ms]. */
const SETTLED = 120;
/** A displacement below this part of the largest one is rounding. */
const NOISE = 1e-9;
/** Longest edited text in a link. */
const LINK_TEXT = 6000;

class Page {
  constructor(root, transport, view) {
    this.root = root;
    this.transport = transport;
    this.channels = new Map();
    this.state = { set: {}, ports: {}, text: null, ...view };
    this.visible = !document.hidden;
    this.touched = "";
    this.figure = new Figure();
    this.figure.describe = k => this.beamTip(k);
    this.figure.onselect = k => this.showBeam(k);
    this.controls = new Controls((name, value) => this.set("set", name, value), (name, value) => this.set("ports", name, value));
    this.editor = new Editor(text => this.edit(text), force => this.save(force));
    this.tabs = [new StaticTab(this), new ModesTab(this), new PathTab(this), new TransientTab(this), new ResponseTab(this), new CircuitTab(this), new YieldTab(this)];
    this.tab = this.tabs[0];
    this.later = debounced(SETTLED, kind => this.besides(kind));
    this.link = debounced(400, () => this.writeLink());
    this.build();
    document.addEventListener("visibilitychange", () => { this.visible = !document.hidden; if (this.visible) this.tab.shown(); });
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { this.figure.surface.refresh(); this.tabs.forEach(tab => tab.chart?.surface.refresh()); });
  }

  build() {
    const { live } = this.transport;
    this.title = el("h1", {}, "Bimorph bench");
    this.words = el("ul", { class: "words", role: "status", "aria-live": "polite" });
    this.readings = el("div", { class: "readings" });
    this.beam = el("div", { class: "beam" });
    this.compare = el("div", { class: "compare" });
    this.exaggeration = el("select", { "aria-label": "scale of displacements", onchange: () => { this.figure.exaggeration = Number(this.exaggeration.value) || null; this.figure.surface.refresh(); if (this.tab.id === "transient") this.tab.shown(); } },
      [["", "auto"], ...[1, 2, 5, 10, 20, 50, 100, 200, 500, 1000].map(x => [x, `× ${x}`])].map(([value, text]) => el("option", { value }, text)));
    const button = (text, act, title = "") => el("button", { type: "button", onclick: act, title }, text);
    this.keep = button("Keep as A", () => this.keepA(), "compare the states that follow with this one");
    this.editorSwitch = button("Netlist", () => this.showEditor(this.editor.element.hidden), "the netlist with its messages");
    this.editor.element.hidden = true;
    const tabButtons = this.tabs.map((tab, k) => {
      tab.button = el("button", { type: "button", role: "tab", id: `tab-${tab.id}`, "aria-controls": `panel-${tab.id}`, onclick: () => this.show(tab), onkeydown: event => this.tabKey(event, k) }, tab.title);
      tab.panel.id = `panel-${tab.id}`;
      tab.panel.setAttribute("role", "tabpanel");
      tab.panel.setAttribute("aria-labelledby", `tab-${tab.id}`);
      return tab.button;
    });
    this.signalList = el("datalist", { id: "bench-signals" });
    fill(this.root, el("div", { class: "bench" },
      el("header", {}, this.title, el("nav", { role: "tablist", "aria-label": "analyses" }, tabButtons),
        el("div", { class: "acts" }, live ? [button("Reset", () => this.resetAll(), "all parameters and ports as given"), this.keep, this.editorSwitch, button("Link", () => this.copyLink(), "copy a link to this state"), button("Export", () => this.export(), "one file with this state, for others")] : el("span", { class: "note" }, "exported page: values as they were"))),
      el("aside", { class: "left" }, this.controls.element),
      el("main", {}, el("div", { class: "stage" }, this.figure.element, el("div", { class: "zoom" }, el("label", {}, "displacements ", this.exaggeration), button("+", () => this.figure.zoom(1.3), "closer"), button("−", () => this.figure.zoom(1 / 1.3), "farther"), button("Fit", () => this.figure.reset()))),
        el("div", { class: "panels" }, this.tabs.map(tab => tab.panel))),
      el("aside", { class: "right" }, this.words, this.beam, this.compare, this.readings), this.editor.element, this.signalList));
  }

  tabKey(event, k) {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!step) return;
    const next = this.tabs[(k + step + this.tabs.length) % this.tabs.length];
    next.button.focus();
    this.show(next);
  }

  latest(channel) {
    if (!this.channels.has(channel)) this.channels.set(channel, new Latest(this.transport, channel));
    return this.channels.get(channel);
  }

  /** Tells listeners that a new picture is drawn. */
  pictured(kind) {
    requestAnimationFrame(() => this.root.dispatchEvent(new CustomEvent("picture", { detail: { kind, at: performance.now() } })));
  }

  async start() {
    this.readLink();
    try {
      await this.describe();
    } catch (error) {
      fill(this.words, el("li", { class: "bad" }, error.message));
      return;
    }
    if (this.description.has_layout) {
      this.transport.ask("layout", {}, { kind: "layout" }).then(ground => { this.figure.ground = ground; this.figure.surface.refresh(); }, () => undefined);
    }
    this.transport.events((name, data) => this.heard(name, data));
    const wanted = this.tabs.find(tab => tab.id === this.wantedTab) ?? this.tabs[0];
    for (const tab of this.tabs) this.mark(tab, tab === wanted);
    this.tab = wanted;
    if (!this.transport.live) await this.frequenciesNow();
    await this.compute("all");
    this.tab.shown();
  }

  async describe() {
    const answer = await this.transport.ask("describe", { ...this.state }, { kind: "describe" });
    this.description = answer;
    document.title = this.notebook ? document.title : `${answer.title} – Bimorph bench`;
    fill(this.title, answer.title);
    for (const [name, volts] of Object.entries(answer.initial_ports)) this.state.ports[name] ??= volts;
    this.controls.show(answer, this.state, this.transport.live);
    fill(this.signalList, answer.signals.slice(0, 1500).map(value => el("option", { value })));
    this.editor.show(answer, this.state.text);
    this.editor.report(answer.diagnostics ?? []);
    for (const tab of this.tabs) tab.describe?.(answer);
    if (answer.error) this.showEditor(true);
  }

  /** Range and value of a port or parameter. */
  entry(name) {
    return [...this.description.ports, ...this.description.parameters].find(entry => entry.name === name);
  }

  /** Present value of a port or parameter. */
  valueOf(name) {
    if (this.description.ports.some(port => port.name === name)) return this.state.ports[name] ?? 0;
    return this.state.set[name] ?? this.entry(name)?.value ?? null;
  }

  /** The state with one port or parameter as given: what a path along it does not depend on. */
  stateWithout(name) {
    const state = { ...this.state, set: { ...this.state.set }, ports: { ...this.state.ports } };
    delete state.set[name];
    delete state.ports[name];
    return state;
  }

  set(kind, name, value) {
    this.state[kind][name] = value;
    this.touched = name;
    this.compute(kind === "ports" ? "port" : "set");
    this.link();
  }

  setParameters(set) {
    for (const [name, value] of Object.entries(set)) {
      const kind = name.endsWith(".v") && this.description.ports.some(p => `${p.name}.v` === name) ? "ports" : "set";
      const own = kind === "ports" ? name.slice(0, -2) : name;
      this.state[kind][own] = value;
      this.controls.set(kind, own, value);
    }
    this.touched = "";
    this.compute("set");
    this.link();
  }

  resetAll() {
    this.state.set = {};
    this.state.ports = { ...this.description.initial_ports };
    this.touched = "";
    this.controls.show(this.description, this.state, this.transport.live);
    this.compute("set");
    this.link();
  }

  /** Statics at once, everything else after a pause. */
  async compute(kind) {
    this.later(kind === "port" && this.pendingKind !== "set" ? "port" : (this.pendingKind = "set"));
    try {
      const answer = await this.latest("static").ask(this.state, { kind: "static" });
      if (!answer) return;
      this.static = answer;
      this.failed = null;
      if (["static", "path", "response", "circuit", "yield"].includes(this.tab.id)) this.showStatic();
      this.tabs[0].changed("static");
      this.readingsNow();
      this.editor.report(answer.diagnostics);
      this.pictured("static");
    } catch (error) {
      this.failed = error;
      this.editor.report(error.refusal?.diagnostics ?? []);
      if (error.refusal?.diagnostics?.length) this.frequencies = null;
      this.readingsNow();
      this.pictured("refused");
    }
  }

  async frequenciesNow() {
    try {
      this.frequencies = await this.latest("frequencies").ask(this.state, { kind: "modes", count: FIRST_MODES, shapes: false }) ?? this.frequencies;
    } catch (error) {
      this.frequencies = { failed: error.message, frequencies_hz: [], qualities: null };
    }
    this.readingsNow();
  }

  async besides(kind) {
    this.pendingKind = "";
    const own = this.tab;
    const all = [this.transport.live ? this.frequenciesNow() : null, this.tabs[0].changed(kind)];
    if (kind !== "port") all.push(this.pullInNow());
    for (const tab of this.tabs.slice(1)) if (tab !== own) tab.changed(kind);
    await Promise.allSettled(all);
    if (own !== this.tabs[0]) await own.changed(kind);
  }

  /** Pull-in of the port that has one in its range; of others the reason that they have none. */
  async pullInNow() {
    const port = this.description.ports.find(p => p.pull_in_v), without = this.description.ports.find(p => p.no_pull_in);
    if (!port) {
      this.pullIn = without ? { failed: without.no_pull_in } : null;
      return this.readingsNow();
    }
    try {
      this.pullIn = await this.latest("pullin").ask(this.stateWithout(port.name), { kind: "pullin", port: port.name, max: 200 }) ?? this.pullIn;
    } catch (error) {
      this.pullIn = { failed: error.message };
    }
    return this.readingsNow();
  }

  showStatic() {
    if (!this.static) return;
    this.figure.caption = "";
    this.figure.fixedFactor = null;
    this.figure.amplitude = 1;
    this.figure.shape = false;
    this.figure.show(this.static);
    this.paint();
  }

  paint() {
    const kind = this.tabs[0].colour.value, { static: answer } = this;
    if (!answer || !kind) return this.figure.paintBy(null);
    const heat = new Map(answer.temperatures_k);
    const values = answer.figure.names.map((name, k) => (kind === "temperature" ? heat.get(name) ?? null : answer.beams[k]?.[kind === "stress" ? 3 : 4] ?? null));
    const label = { temperature: "mean temperature", stress: "largest stress", energy: "share of the strain energy" }[kind];
    return this.figure.paintBy({ values, label, unit: { temperature: "K", stress: "Pa", energy: "" }[kind], low: kind === "temperature" ? undefined : 0 });
  }

  /** Value of NODE.x, NODE.y or NODE.rz in the static state. */
  signal(name) {
    const [, node, quantityName] = /^(.*)\.(x|y|rz)$/.exec(name) ?? [];
    const found = this.static?.nodes.find(([other]) => other === node);
    return found ? found[1][["x", "y", "rz"].indexOf(quantityName)] : NaN;
  }

  /** The node that moves most, and its direction. */
  busiest() {
    let best = null, most = 0;
    for (const [node, [x, y]] of this.static?.nodes ?? []) {
      if (Math.hypot(x, y) > most) { most = Math.hypot(x, y); best = { node, direction: Math.abs(x) > Math.abs(y) ? "x" : "y", x, y }; }
    }
    if (best) return best;
    const free = (this.description.signals.find(name => name.endsWith(".x")) ?? "").slice(0, -2);
    return free ? { node: free, direction: "x", x: 0, y: 0 } : null;
  }

  readingsNow() {
    const { static: s, frequencies: f } = this, words = [];
    if (this.failed) words.push(["bad", this.failed.message]);
    else if (s) {
      if (s.pulled_in) words.push(["bad", "Pulled in: a gap is closed."]);
      else if (s.jumped) words.push(["bad", "Snapped through or buckled on the way to this state."]);
      words.push(...s.notes.map(note => ["", note]), ...s.warnings.map(warning => ["warn", warning]));
    }
    if (this.pullIn?.pull_in) {
      const p = this.pullIn.pull_in;
      words.push(["", `${p.port} pulls in at ${quantity(p.pull_in_v, "V")}${p.release_v === null ? "." : ` and releases at ${quantity(p.release_v, "V")}.`} ${this.pullIn.notes.join(" ")}`]);
    } else if (this.pullIn?.failed) words.push(["", this.pullIn.failed.replace("no static equilibrium: ", "")]);
    fill(this.words, words.map(([kind, text]) => el("li", { class: kind }, text)));
    if (!s) return fill(this.readings);
    const busiest = this.busiest(), hottest = s.peaks_k.length ? s.peaks_k : s.temperatures_k;
    const hot = hottest.reduce((a, b) => (b[1] > (a?.[1] ?? 0) ? b : a), null);
    const rows = [];
    if (busiest) for (const d of ["x", "y"]) rows.push([`${busiest.node}.${d}`, quantity(Math.abs(busiest[d]) < NOISE * Math.hypot(busiest.x, busiest.y) ? 0 : busiest[d], "m")]);
    if (hot) rows.push([`hottest: ${hot[0]}`, quantity(hot[1], "K")]);
    for (const [port, i] of s.currents_a) if (i !== 0) rows.push([`${port}.i`, quantity(i, "A")]);
    for (const [port, q] of s.charges_c) if (q !== 0) rows.push([`${port}.q`, quantity(q, "C")]);
    (f?.frequencies_hz ?? []).slice(0, FIRST_MODES).forEach((hz, k) => rows.push([`mode ${k + 1}`, `${quantity(hz, "Hz")}${f.qualities?.[k] ? `, Q ${digits(f.qualities[k], 3)}` : ""}`]));
    if (f?.failed) rows.push(["modes", f.failed]);
    const error = s.estimated_error === null ? "" : `, estimated error ${s.estimated_error.toExponential(1)}`;
    fill(this.readings, el("h2", {}, "State"), table(rows), el("p", { class: "note" }, `${s.unknowns} unknowns${error}`));
    this.rowsNow = rows;
    this.compareNow();
    if (this.figure.selected >= 0) this.showBeam(this.figure.selected);
    return undefined;
  }

  /** Values of the present state by name. */
  values() {
    const { static: s, frequencies: f } = this, found = new Map();
    for (const [name, value] of Object.entries(this.state.set)) found.set(name, [value, this.entry(name)?.unit ?? ""]);
    for (const [name, value] of Object.entries(this.state.ports)) found.set(name, [value, "V"]);
    const watched = this.a?.busiest ?? this.busiest();
    const moved = watched ? ["x", "y"].map(d => this.signal(`${watched.node}.${d}`)) : [];
    moved.forEach((x, k) => found.set(`${watched.node}.${"xy"[k]}`, [Math.abs(x) < NOISE * Math.hypot(...moved) ? 0 : x, "m"]));
    for (const [name, i] of s.currents_a) found.set(`${name}.i`, [i, "A"]);
    for (const [name, q] of s.charges_c) found.set(`${name}.q`, [q, "C"]);
    (f?.frequencies_hz ?? []).slice(0, FIRST_MODES).forEach((hz, k) => found.set(`mode ${k + 1}`, [hz, "Hz"]));
    return found;
  }

  keepA() {
    if (this.a) {
      this.a = null;
      this.figure.other = null;
      fill(this.keep, "Keep as A");
    } else if (this.static) {
      const busiest = this.busiest();
      this.a = { busiest };
      this.a.values = this.values();
      const { points, motion, widths } = this.static.arrays;
      this.figure.other = { points, motion, widths, figure: this.static.figure };
      fill(this.keep, "Clear A");
    }
    this.figure.surface.refresh();
    this.compareNow();
  }

  compareNow() {
    if (!this.a || !this.static) return fill(this.compare);
    const now = this.values(), names = [...new Set([...this.a.values.keys(), ...now.keys()])];
    const rows = names.map(name => {
      const fallback = [this.entry(name)?.value ?? 0, this.entry(name)?.unit ?? ""];
      const [a, unit] = this.a.values.get(name) ?? fallback, [b] = now.get(name) ?? fallback;
      if (typeof a !== "number" || typeof b !== "number") return [name, String(a), String(b), ""];
      const change = a !== 0 ? `${((b - a) / Math.abs(a) * 100).toFixed(2)} %` : quantity(b - a, unit);
      return [name, quantity(a, unit), quantity(b, unit), a === b ? "=" : change];
    }).filter(row => row[3] !== "=" || (/mode|\./.test(row[0]) && !row[1].startsWith("0 ")));
    return fill(this.compare, el("h2", {}, "A and B"), table(rows, ["", "A", "B", "B − A"]));
  }

  beamTip(k) {
    const s = this.static, name = this.figure.geometry.names[k];
    if (!s || s.figure.names[k] !== name) return name;
    const state = s.beams[k], heat = s.temperatures_k.find(([other]) => other === name);
    return [el("b", {}, name), heat ? el("div", {}, quantity(heat[1], "K")) : null, state ? el("div", {}, `stress ${quantity(state[3], "Pa")}`) : el("div", {}, "rigid"), state ? el("div", {}, `energy ${(100 * state[4]).toFixed(1)} %`) : null];
  }

  showBeam(k) {
    const s = this.static;
    if (k < 0 || !s || !s.figure.names[k]) return fill(this.beam);
    const name = s.figure.names[k], state = s.beams[k], place = s.figure.places[k];
    const heat = s.temperatures_k.find(([other]) => other === name), peak = s.peaks_k.find(([other]) => other === name);
    const rows = [];
    if (state) rows.push(["normal force", quantity(state[0], "N")], ["shear force", quantity(state[1], "N")], ["moment", quantity(state[2], "N·m")], ["largest stress", quantity(state[3], "Pa")], ["strain energy", `${(100 * state[4]).toFixed(2)} % of all`]);
    if (heat) rows.push(["temperature", quantity(heat[1], "K")]);
    if (peak) rows.push(["highest", quantity(peak[1], "K")]);
    const line = place ? el("button", { type: "button", class: "line", onclick: () => { this.showEditor(true); this.editor.go(s.figure.files[place[0]], place[1]); } }, `${s.figure.files[place[0]]}:${place[1]}`) : null;
    const text = place ? (this.description.files[s.figure.files[place[0]]] ?? "").split("\n")[place[1] - 1] ?? "" : "";
    return fill(this.beam, el("h2", {}, `Beam ${name}`), line, text ? el("pre", {}, text.trim()) : null, table(rows.length ? rows : [["rigid", "no strain"]]));
  }

  edit(text) {
    this.state.text = text === this.description.files[this.description.root] ? null : text;
    this.redescribe();
    this.compute("set");
    this.link();
  }

  /** Parameters and ports may be others after an edit. */
  async redescribe() {
    try {
      const answer = await this.latest("describe").ask(this.state, { kind: "describe" });
      if (!answer || answer.error) return;
      this.description = { ...answer, files: this.description.files };
      for (const kind of ["set", "ports"]) {
        const known = new Set((kind === "set" ? answer.parameters : answer.ports).map(entry => entry.name));
        for (const name of Object.keys(this.state[kind])) if (!known.has(name)) delete this.state[kind][name];
      }
      this.controls.show(this.description, this.state, this.transport.live);
      for (const tab of this.tabs) tab.describe?.(this.description);
      this.compute("set");
    } catch { /* the messages are those of the statics */ }
  }

  async save(force) {
    try {
      await this.transport.ask("save", this.state, { kind: "save", force });
      this.state.text = null;
      this.editor.saved();
      // the server still has the text that it began with
      this.state.text = this.editor.edited;
      this.editor.buttons();
    } catch (error) {
      this.editor.refused(error.message);
    }
  }

  showEditor(open) {
    this.editor.element.hidden = !open;
    this.root.firstElementChild.classList.toggle("with-editor", open);
    this.editorSwitch.setAttribute("aria-expanded", String(open));
    if (open) this.editor.number();
  }

  mark(tab, chosen) {
    tab.panel.hidden = !chosen;
    tab.button.setAttribute("aria-selected", String(chosen));
    tab.button.tabIndex = chosen ? 0 : -1;
  }

  show(tab) {
    for (const other of this.tabs) this.mark(other, other === tab);
    this.tab = tab;
    this.figure.fixedFactor = null;
    this.figure.caption = "";
    this.figure.amplitude = 1;
    this.figure.shape = false;
    tab.shown();
    this.link();
  }

  heard(name, data) {
    if (name === "progress" && data.channel === "yield") this.tabs[6].progress.value = data.fraction;
    if (name === "file" && this.state.text === null) fill(this.editor.status, "the file has changed on disk: start the bench again to read it");
  }

  linkState() {
    const { set, ports, text } = this.state, state = { set, ports, tab: this.tab.id };
    if (text !== null && text.length <= LINK_TEXT) state.text = text;
    return `#${encodeURIComponent(JSON.stringify(state))}`;
  }

  writeLink() {
    if (this.transport.live && !this.notebook) history.replaceState(null, "", this.linkState());
  }

  readLink() {
    if (!this.transport.live || this.notebook || location.hash.length < 3) return;
    try {
      const { set = {}, ports = {}, text = null, tab } = JSON.parse(decodeURIComponent(location.hash.slice(1)));
      const numbers = list => Object.fromEntries(Object.entries(list).filter(([, value]) => ["number", "string"].includes(typeof value)));
      this.state = { set: numbers(set), ports: numbers(ports), text: typeof text === "string" ? text : null };
      this.wantedTab = tab;
    } catch { /* a foreign link: the state as given */ }
  }

  async copyLink() {
    const url = location.href.split("#")[0] + this.linkState();
    this.writeLink();
    try {
      await navigator.clipboard.writeText(url);
      this.say("the link is copied; it works while this bench runs");
    } catch {
      this.say("the address line has the link; it works while this bench runs");
    }
  }

  say(text) {
    fill(this.words, el("li", {}, text));
    setTimeout(() => this.readingsNow(), 4000);
  }

  async export() {
    const asks = {
      describe: { kind: "describe" }, static: { kind: "static" }, frequencies: { kind: "modes", count: FIRST_MODES, shapes: false },
      modes: this.tabs[1].request(),
    };
    if (this.description.has_layout) asks.layout = { kind: "layout" };
    if (this.tabs[0].chosen) asks.curve = this.tabs[0].request();
    for (const tab of this.tabs.slice(2)) if (tab.answer) asks[tab.id] = tab.request();
    const pullsIn = this.description.ports.find(p => p.pull_in_v);
    if (pullsIn) asks.pullin = { kind: "pullin", port: pullsIn.name, max: 200 };
    this.say("the page is written …");
    try {
      const view = { set: this.state.set, ports: this.state.ports, text: this.state.text };
      const html = await this.transport.ask("export", this.state, { kind: "export", asks, view });
      const url = URL.createObjectURL(new Blob([html], { type: "text/html" }));
      const anchor = el("a", { href: url, download: `${this.description.title.replace(/\.\w+$/, "")}.html` });
      anchor.click();
      setTimeout(() => URL.revokeObjectURL(url), 10000);
      this.say(`exported: ${(html.length / 1e6).toFixed(2)} MB`);
    } catch (error) {
      this.say(error.message);
    }
  }
}

/** Shows the bench in an element. */
export function mount(root, transport, view = {}, notebook = false) {
  const page = new Page(root, transport, view);
  page.notebook = notebook;
  root.bench = page;
  page.start();
  return page;
}

/** Shows the bench in a notebook. */
export function render({ model, el: root }) {
  root.classList.add("bench-notebook");
  mount(root, new WidgetTransport(model), JSON.parse(model.get("view") || "{}"), true);
}

/** Shows the bench where the page has a place for it. */
export function automount(recorded = null) {
  const root = document.getElementById("bench");
  if (root && !root.bench) mount(root, recorded ? new RecordedTransport(recorded) : new Transport(), recorded ? { ...recorded.view } : {});
}
