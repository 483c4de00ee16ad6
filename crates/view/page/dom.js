// Elements of the page.

/** An element: el("p", {class: "note"}, "text", child). Properties that begin with "on" are listeners. */
export function el(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name in element && !name.startsWith("aria") && name !== "list" && name !== "form") element[name] = value;
    else element.setAttribute(name === "class" ? "class" : name, value === true ? "" : value);
  }
  if (properties.class) element.className = properties.class;
  element.append(...children.flat(Infinity).filter(child => child !== null && child !== undefined));
  return element;
}

/** Replaces the content of an element. */
export function fill(element, ...children) {
  element.replaceChildren(...children.flat(Infinity).filter(child => child !== null && child !== undefined));
}

/** A table of rows [name, value]; the first cell heads its row. */
export function table(rows, heads = null) {
  const body = rows.map(row => el("tr", {}, row.map((cell, k) => el(k ? "td" : "th", k ? {} : { scope: "row" }, cell))));
  const head = heads ? [el("thead", {}, el("tr", {}, heads.map(text => el("th", { scope: "col" }, text))))] : [];
  return el("table", {}, head, el("tbody", {}, body));
}

/** Calls a function once after a pause without further calls [ms]. */
export function debounced(pause, call) {
  let timer = 0;
  return (...values) => {
    clearTimeout(timer);
    timer = setTimeout(() => call(...values), pause);
  };
}

/** A labelled field. */
export function field(label, input, hint = "") {
  return el("label", { class: "field", title: hint }, el("span", {}, label), input);
}

/** A canvas that keeps the size of its box. `paint` is called at the next frame after each change. */
export class Surface {
  constructor(label, paint) {
    this.canvas = el("canvas", { tabIndex: 0, role: "img", "aria-label": label });
    this.box = el("div", { class: "surface" }, this.canvas);
    this.paint = paint;
    this.waiting = false;
    this.observer = new ResizeObserver(() => this.refresh());
    this.observer.observe(this.box);
  }

  refresh() {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.draw();
    });
  }

  draw() {
    const wide = this.box.clientWidth, tall = this.box.clientHeight;
    if (wide < 2 || tall < 2) return;
    const ratio = window.devicePixelRatio || 1;
    if (this.canvas.width !== Math.round(wide * ratio) || this.canvas.height !== Math.round(tall * ratio)) {
      this.canvas.width = Math.round(wide * ratio);
      this.canvas.height = Math.round(tall * ratio);
    }
    const context = this.canvas.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, wide, tall);
    this.paint(context, wide, tall);
  }
}

/** Colours of the page in its present scheme. */
export function theme(element) {
  const style = getComputedStyle(element);
  const read = name => style.getPropertyValue(name).trim();
  return {
    ink: read("--ink"), muted: read("--muted"), grid: read("--grid"), ground: read("--ground"), rest: read("--rest"), moved: read("--moved"),
    accent: read("--accent"), bad: read("--bad"), layout: read("--layout"), anchor: read("--anchor"),
    curves: ["--c0", "--c1", "--c2", "--c3", "--c4", "--c5"].map(read),
  };
}
