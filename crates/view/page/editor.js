// The netlist with its messages at their lines.

import { debounced, el, fill } from "./dom.js";

/** Pause after which an edit is computed [ms]. */
const PAUSE = 350;

export class Editor {
  /** `edited(text)` after a pause, `save(force)` on request. */
  constructor(edited, save) {
    this.text = el("textarea", { spellcheck: false, wrap: "off", autocomplete: "off", "aria-label": "netlist" });
    this.gutter = el("div", { class: "gutter", "aria-hidden": "true" });
    this.messages = el("ul", { class: "messages", role: "log", "aria-label": "messages about the netlist" });
    this.file = el("select", { "aria-label": "file", onchange: () => this.open(this.file.value) });
    this.saveButton = el("button", { type: "button", disabled: true, onclick: () => save(this.force) }, "Save to file");
    this.revert = el("button", { type: "button", disabled: true, onclick: () => { this.text.value = this.files[this.root]; this.input(true); } }, "Revert");
    this.status = el("span", { class: "note", role: "status" });
    this.element = el("section", { class: "editor", "aria-label": "netlist editor" },
      el("div", { class: "row" }, this.file, this.saveButton, this.revert, this.status),
      el("div", { class: "code" }, this.gutter, this.text), this.messages);
    this.marked = new Map();
    this.force = false;
    this.later = debounced(PAUSE, () => edited(this.text.value));
    this.text.addEventListener("input", () => this.input(false));
    this.text.addEventListener("scroll", () => { this.gutter.scrollTop = this.text.scrollTop; });
    this.text.addEventListener("keydown", event => {
      if ((event.ctrlKey || event.metaKey) && event.key === "s") {
        event.preventDefault();
        if (!this.saveButton.disabled) save(this.force);
      }
    });
  }

  show(description, text) {
    this.files = description.files;
    this.root = description.root;
    this.editable = description.editable;
    fill(this.file, Object.keys(this.files).sort((a, b) => (b === this.root) - (a === this.root)).map(name => el("option", { value: name }, name)));
    this.edited = text ?? this.files[this.root];
    this.open(this.root);
  }

  open(name) {
    this.file.value = name;
    this.opened = name;
    this.text.value = name === this.root ? this.edited : this.files[name] ?? "";
    this.text.readOnly = name !== this.root || !this.editable;
    fill(this.status, this.text.readOnly ? (this.editable ? "included: read only" : "from the layout: read only") : "");
    this.number();
    this.buttons();
  }

  input(now) {
    this.edited = this.text.value;
    this.number();
    this.buttons();
    if (now) this.later(); else this.later();
  }

  buttons() {
    const changed = this.edited !== this.files[this.root];
    this.saveButton.disabled = this.revert.disabled = !changed || !this.editable;
  }

  saved() {
    this.files[this.root] = this.edited;
    this.force = false;
    fill(this.status, "saved");
    this.buttons();
  }

  refused(sentence) {
    this.force = true;
    fill(this.status, sentence);
  }

  /** Messages with lines. */
  report(diagnostics) {
    this.marked = new Map();
    for (const d of diagnostics) if (d.line && d.file === this.root) this.marked.set(d.line, d.severity);
    fill(this.messages, diagnostics.map(d => el("li", { class: d.severity },
      d.line ? el("button", { type: "button", onclick: () => this.go(d.file, d.line) }, `${d.file === this.root ? "" : d.file + " "}line ${d.line}`) : null,
      ` ${d.message}`, d.help ? el("small", {}, ` ${d.help}`) : null, el("code", {}, ` ${d.code}`))));
    this.number();
  }

  number() {
    const count = this.text.value.split("\n").length, own = this.opened === this.root;
    fill(this.gutter, Array.from({ length: count }, (_, k) => el("span", { class: own ? this.marked.get(k + 1) ?? "" : "" }, String(k + 1))));
    this.gutter.scrollTop = this.text.scrollTop;
  }

  /** Shows a line and selects it. */
  go(file, line) {
    if (!(file in this.files)) return;
    if (file !== this.opened) this.open(file);
    const lines = this.text.value.split("\n"), start = lines.slice(0, line - 1).join("\n").length + (line > 1 ? 1 : 0);
    this.text.focus({ preventScroll: true });
    this.text.setSelectionRange(start, start + (lines[line - 1] ?? "").length);
    const height = this.text.scrollHeight / Math.max(lines.length, 1);
    this.text.scrollTop = Math.max(0, (line - 6) * height);
    this.gutter.scrollTop = this.text.scrollTop;
  }
}
