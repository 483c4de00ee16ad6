// The mechanism: at rest in grey, displaced in colour, with its gaps at the scale of the displacements.

import { niceStep } from "./axes.js";
import { Surface, el, fill, theme } from "./dom.js";
import { quantity } from "./units.js";

/** Part of the size of the mechanism that the largest displacement becomes. */
const VISIBLE = 0.08;
/** Colours from low to high: viridis, at eight places. */
const SCALE = ["#440154", "#46327e", "#365c8d", "#277f8e", "#1fa187", "#4ac16d", "#a0da39", "#fde725"];

function scaleColour(s) {
  const at = Math.min(Math.max(s, 0), 1) * (SCALE.length - 1), k = Math.min(Math.floor(at), SCALE.length - 2), r = at - k;
  const part = (text, i) => parseInt(text.slice(1 + 2 * i, 3 + 2 * i), 16);
  const mixed = [0, 1, 2].map(i => Math.round(part(SCALE[k], i) * (1 - r) + part(SCALE[k + 1], i) * r));
  return `rgb(${mixed.join(",")})`;
}

/** The largest of 1, 2, 5 times a power of ten not above `x`. */
export function roundDown(x) {
  if (!Number.isFinite(x) || x <= 0) return 1;
  for (const step of [1, 0.7, 0.5, 0.4, 0.3, 0.2]) if (niceStep(step * x) <= x * (1 + 1e-9)) return niceStep(step * x);
  return x;
}

export class Figure {
  constructor() {
    this.geometry = null;
    this.motion = null;
    this.other = null;
    this.ground = null;
    this.colour = null;
    this.exaggeration = null;
    this.amplitude = 1;
    this.shape = false;
    this.selected = -1;
    this.hovered = -1;
    this.view = { zoom: 1, x: 0, y: 0 };
    this.surface = new Surface("the mechanism", (context, wide, tall) => this.paint(context, wide, tall));
    this.note = el("p", { class: "figure-note" });
    this.tip = el("div", { class: "tip", hidden: true });
    this.surface.box.append(this.tip);
    this.bar = el("div", { class: "colour-bar", hidden: true });
    this.element = el("section", { class: "figure", "aria-label": "mechanism" }, this.surface.box, this.bar, this.note);
    this.listen();
  }

  /** Shows an answer's geometry and displacements. */
  show(answer, motion = answer.arrays.motion) {
    this.geometry = answer.figure;
    this.points = answer.arrays.points;
    this.widths = answer.arrays.widths;
    this.motion = motion;
    this.surface.refresh();
  }

  /** Displacements alone, of the same geometry. */
  move(motion, amplitude = 1) {
    this.motion = motion;
    this.amplitude = amplitude;
    this.surface.refresh();
  }

  /** Colours by value of each beam: {values, unit, label}; null: one colour. */
  paintBy(colour) {
    this.colour = colour;
    this.showBar();
    this.surface.refresh();
  }

  showBar() {
    const range = this.colourRange();
    this.bar.hidden = !range;
    if (range) fill(this.bar, el("span", {}, quantity(range[0], this.colour.unit, 3)), el("i", {}), el("span", {}, quantity(range[1], this.colour.unit, 3)), el("b", {}, this.colour.label));
  }

  colourRange() {
    const values = this.colour?.values.filter(x => x !== null && Number.isFinite(x)) ?? [];
    if (!values.length) return null;
    const [low, high] = [Math.min(this.colour.low ?? Infinity, ...values), Math.max(...values)];
    return [low, high > low ? high : low + 1e-30];
  }

  /** Factor on displacements: the chosen one, or one that shows the motion and closes no gap on the picture that is open. */
  factor() {
    if (this.exaggeration) return this.exaggeration;
    if (this.fixedFactor) return this.fixedFactor;
    const [x0, y0, x1, y1] = this.geometry.bounds, size = Math.max(x1 - x0, y1 - y0);
    let largest = 0;
    for (let i = 0; i < this.motion.length; i += 3) largest = Math.max(largest, Math.hypot(this.motion[i], this.motion[i + 1]));
    if (!(largest > 0)) return 1;
    return Math.max(1, roundDown(Math.min(VISIBLE * size / largest, this.openFactor())));
  }

  /** Factor at which the first gap closes on the picture: of gaps with two moving sides, whose drawn distance is not scaled. */
  openFactor() {
    const move = (i, axis) => this.motion[3 * i] * axis[0] + this.motion[3 * i + 1] * axis[1];
    let most = Infinity;
    for (const gap of this.geometry.gaps.filter(gap => !gap.fixed)) {
      gap.upper.forEach((node, k) => {
        const way = move(node, gap.axis) - move(gap.lower[k], gap.axis);
        if (way > 1e-3 * gap.gap) most = Math.min(most, gap.gap / way);
      });
    }
    return most;
  }

  transform(wide, tall) {
    const [x0, y0, x1, y1] = this.geometry.bounds;
    const size = Math.max(x1 - x0, y1 - y0, 1e-12), room = 0.5 * VISIBLE * size + 0.03 * size;
    const [w, h] = [x1 - x0 + 2 * room, y1 - y0 + 2 * room];
    const scale = Math.min(wide / w, tall / h) * this.view.zoom;
    const cx = (x0 + x1) / 2 + this.view.x, cy = (y0 + y1) / 2 + this.view.y;
    return { scale, X: x => wide / 2 + (x - cx) * scale, Y: y => tall / 2 - (y - cy) * scale, wide, tall, cx, cy };
  }

  paint(c, wide, tall) {
    if (!this.geometry) return;
    const colours = theme(this.element), t = this.transform(wide, tall), f = this.factor() * this.amplitude;
    this.last = { t, f };
    // a mode shape stands for no length: its gaps stay as drawn
    const gapScale = this.shape ? 1 : f;
    this.paintGround(c, colours, t);
    this.paintFixed(c, colours, t, gapScale);
    this.paintParts(c, t, this.points, null, 1, colours.rest, false);
    if (this.other) this.paintParts(c, t, this.other.points, this.other.motion, f, colours.curves[1], false, this.other);
    c.globalAlpha = 0.92;
    this.paintParts(c, t, this.points, this.motion, f, colours.moved, true);
    c.globalAlpha = 1;
    this.paintPorts(c, colours, t, f);
    this.paintScale(c, colours, t, tall);
    const times = this.shape ? 1 : f;
    const stated = this.shape ? "mode shape, amplitude as chosen" : `displacements × ${Number(times.toPrecision(3))}`;
    fill(this.note, this.caption ? `${this.caption}  ·  ` : "", `${stated}${!this.shape && this.geometry.gaps.some(gap => gap.fixed) && times > 1 ? ", gaps to fixed parts alike" : ""}  ·  grey: as drawn${this.other ? "  ·  orange: A" : ""}`);
  }

  paintGround(c, colours, t) {
    if (!this.ground) return;
    c.fillStyle = colours.layout;
    let at = 0;
    const { layers, arrays } = this.ground;
    for (const [, counts] of layers) {
      c.beginPath();
      for (const count of counts) {
        for (let k = 0; k < count; k++, at += 2) {
          const x = t.X(arrays.contours[at]), y = t.Y(arrays.contours[at + 1]);
          if (k) c.lineTo(x, y);
          else c.moveTo(x, y);
        }
        c.closePath();
      }
      c.fill("evenodd");
    }
  }

  polygon(c, t, shape, close = true) {
    c.beginPath();
    shape.forEach(([x, y], k) => (k ? c.lineTo(t.X(x), t.Y(y)) : c.moveTo(t.X(x), t.Y(y))));
    if (close) c.closePath();
  }

  paintFixed(c, colours, t, f) {
    for (const part of this.geometry.fixed) {
      this.polygon(c, t, part.shape, part.kind !== "guide");
      c.lineWidth = 1;
      c.strokeStyle = colours.muted;
      if (part.kind === "guide") { c.lineWidth = 2; c.stroke(); continue; }
      c.fillStyle = part.kind === "anchor" ? colours.anchor : colours.rest;
      c.fill();
      if (part.kind === "anchor") c.stroke();
    }
    // the other side of a gap is as far away as the displacements are large
    c.strokeStyle = colours.muted;
    c.lineCap = "butt";
    for (const gap of this.geometry.gaps.filter(gap => gap.fixed)) {
      const away = (Math.max(f, 1) - 1) * gap.gap, width = Math.max(gap.widths[1] * t.scale, 2.5);
      const at = node => [this.points[2 * node] + away * gap.axis[0], this.points[2 * node + 1] + away * gap.axis[1]];
      let ends = gap.lower.map(at);
      if (gap.plate) {
        const [[x, y]] = ends, half = gap.plate / 2;
        ends = [[x - half * gap.axis[1], y + half * gap.axis[0]], [x + half * gap.axis[1], y - half * gap.axis[0]]];
      }
      const shift = 0.5 * width / t.scale;
      this.polygon(c, t, ends.map(([x, y]) => [x + shift * gap.axis[0], y + shift * gap.axis[1]]), false);
      c.lineWidth = width;
      c.stroke();
    }
    for (const stop of this.geometry.stops) {
      stop.ways.forEach((way, side) => {
        if (way === null) return;
        const sign = side ? -1 : 1, reach = sign * way * Math.max(f, 1), size = 10 / t.scale;
        const x = this.points[2 * stop.a] + reach * stop.axis[0], y = this.points[2 * stop.a + 1] + reach * stop.axis[1];
        this.polygon(c, t, [[x - size * stop.axis[1], y + size * stop.axis[0]], [x + size * stop.axis[1], y - size * stop.axis[0]]], false);
        c.lineWidth = 3;
        c.stroke();
      });
    }
  }

  paintParts(c, t, points, motion, f, colour, coloured, geometry = null) {
    const g = geometry?.figure ?? this.geometry, widths = geometry?.widths ?? this.widths;
    const u = (i, d) => (motion ? f * motion[3 * i + d] : 0);
    const turn = i => (motion ? (Math.abs(f) > 1.001 ? Math.atan(f * motion[3 * i + 2]) : f * motion[3 * i + 2]) : 0);
    const at = i => [points[2 * i] + u(i, 0), points[2 * i + 1] + u(i, 1)];
    c.strokeStyle = c.fillStyle = colour;
    c.lineCap = "butt";
    c.lineWidth = 2;
    for (const [a, b] of g.links) { this.polygon(c, t, [at(a), at(b)], false); c.stroke(); }
    c.lineWidth = 1.2;
    for (const [a, b] of g.springs) this.paintSpring(c, t, at(a), at(b));
    for (const body of g.bodies) {
      const [x, y] = at(body.at), angle = turn(body.at), cos = Math.cos(angle), sin = Math.sin(angle);
      if (!body.shape.length) {
        c.beginPath();
        c.arc(t.X(x), t.Y(y), 4.5, 0, 2 * Math.PI);
      } else this.polygon(c, t, body.shape.map(([p, q]) => [x + cos * p - sin * q, y + sin * p + cos * q]));
      c.fill();
    }
    for (const gap of g.gaps) {
      if (gap.plate && !gap.widths[0]) continue;
      if (!gap.plate) continue;
      const [x, y] = at(gap.upper[0]), half = gap.plate / 2;
      this.polygon(c, t, [[x - half * gap.axis[1], y + half * gap.axis[0]], [x + half * gap.axis[1], y - half * gap.axis[0]]], false);
      c.lineWidth = 3;
      c.stroke();
    }
    const range = coloured && this.colourRange();
    g.beams.forEach((beam, k) => {
      this.beamPath(c, t, points, beam, at, turn);
      const wide = Math.max(widths[k] * t.scale, 1.4);
      if (coloured && (k === this.selected || k === this.hovered)) {
        c.lineWidth = wide + 6;
        c.strokeStyle = theme(this.element).accent;
        c.globalAlpha = k === this.selected ? 0.6 : 0.35;
        c.stroke();
        c.globalAlpha = 0.92;
      }
      const value = range ? this.colour.values[k] : null;
      c.strokeStyle = value !== null && Number.isFinite(value) ? scaleColour((value - range[0]) / (range[1] - range[0])) : colour;
      c.lineWidth = wide;
      c.lineCap = wide < 8 ? "round" : "butt";
      c.stroke();
    });
  }

  /** The centreline of a beam: the cubic through its points with their directions. */
  beamPath(c, t, points, [a, first, inner, b], at, turn) {
    const count = inner + 1, dx = (points[2 * b] - points[2 * a]) / count, dy = (points[2 * b + 1] - points[2 * a + 1]) / count;
    let before = null;
    c.beginPath();
    for (let k = 0; k <= count; k++) {
      const i = k === 0 ? a : k === count ? b : first + k - 1, [x, y] = at(i), angle = turn(i);
      const cos = Math.cos(angle), sin = Math.sin(angle), tx = (cos * dx - sin * dy) / 3, ty = (sin * dx + cos * dy) / 3;
      if (before) c.bezierCurveTo(t.X(before[0] + before[2]), t.Y(before[1] + before[3]), t.X(x - tx), t.Y(y - ty), t.X(x), t.Y(y));
      else c.moveTo(t.X(x), t.Y(y));
      before = [x, y, tx, ty];
    }
  }

  paintSpring(c, t, [ax, ay], [bx, by]) {
    const length = Math.hypot(bx - ax, by - ay) || 1e-9, size = 6 / t.scale, n = [-(by - ay) / length * size, (bx - ax) / length * size];
    const points = [];
    for (let k = 0; k <= 12; k++) {
      const s = k / 12, side = k < 2 || k > 10 ? 0 : k % 2 ? -1 : 1;
      points.push([ax + s * (bx - ax) + side * n[0], ay + s * (by - ay) + side * n[1]]);
    }
    this.polygon(c, t, points, false);
    c.stroke();
  }

  paintPorts(c, colours, t, f) {
    c.font = "12px system-ui, sans-serif";
    c.textBaseline = "middle";
    for (const [name, node] of this.geometry.ports) {
      if (!this.geometry.mechanical[node]) continue;
      const x = t.X(this.points[2 * node] + f * this.motion[3 * node]), y = t.Y(this.points[2 * node + 1] + f * this.motion[3 * node + 1]);
      c.beginPath();
      c.arc(x, y, 4, 0, 2 * Math.PI);
      c.fillStyle = colours.ground;
      c.strokeStyle = colours.curves[1];
      c.lineWidth = 2;
      c.fill();
      c.stroke();
      const right = x < t.wide - 80;
      c.textAlign = right ? "left" : "right";
      c.lineWidth = 3;
      c.strokeStyle = colours.ground;
      c.strokeText(name, x + (right ? 9 : -9), y);
      c.fillStyle = colours.ink;
      c.fillText(name, x + (right ? 9 : -9), y);
    }
  }

  paintScale(c, colours, t, tall) {
    const length = niceStep(80 / t.scale), pixels = length * t.scale;
    c.strokeStyle = c.fillStyle = colours.ink;
    c.lineWidth = 3;
    c.beginPath();
    c.moveTo(12, tall - 12);
    c.lineTo(12 + pixels, tall - 12);
    c.stroke();
    c.textAlign = "left";
    c.textBaseline = "bottom";
    c.fillText(quantity(length, "m", 2), 12, tall - 16);
  }

  /** The beam nearest to a pixel, within some pixels of its centreline; −1: none. */
  nearest(px, py) {
    if (!this.last || !this.geometry) return -1;
    const { t, f } = this.last;
    let best = -1, least = 9;
    this.geometry.beams.forEach(([a, first, inner, b], k) => {
      const line = [a, ...Array.from({ length: inner }, (_, j) => first + j), b]
        .map(i => [t.X(this.points[2 * i] + f * this.motion[3 * i]), t.Y(this.points[2 * i + 1] + f * this.motion[3 * i + 1])]);
      for (let j = 1; j < line.length; j++) {
        const [[x0, y0], [x1, y1]] = [line[j - 1], line[j]], dx = x1 - x0, dy = y1 - y0;
        const s = Math.min(1, Math.max(0, ((px - x0) * dx + (py - y0) * dy) / (dx * dx + dy * dy || 1)));
        const far = Math.hypot(px - x0 - s * dx, py - y0 - s * dy) - 0.5 * this.widths[k] * t.scale;
        if (far < least) [best, least] = [k, far];
      }
    });
    return best;
  }

  hover(k, x, y) {
    if (k !== this.hovered) {
      this.hovered = k;
      this.surface.refresh();
    }
    this.tip.hidden = k < 0;
    if (k >= 0) {
      fill(this.tip, this.describe?.(k) ?? this.geometry.names[k]);
      this.tip.style.left = `${Math.min(x + 14, this.surface.box.clientWidth - 180)}px`;
      this.tip.style.top = `${Math.max(0, Math.min(y + 14, this.surface.box.clientHeight - 70))}px`;
    }
  }

  select(k) {
    this.selected = k;
    this.surface.refresh();
    this.onselect?.(k);
  }

  zoom(factor, px = null, py = null) {
    const { t } = this.last ?? {};
    const zoom = Math.min(60, Math.max(0.3, this.view.zoom * factor)), real = zoom / this.view.zoom;
    if (t && px !== null) {
      this.view.x += (px - t.wide / 2) / t.scale * (1 - 1 / real);
      this.view.y -= (py - t.tall / 2) / t.scale * (1 - 1 / real);
    }
    this.view.zoom = zoom;
    this.surface.refresh();
  }

  reset() {
    this.view = { zoom: 1, x: 0, y: 0 };
    this.surface.refresh();
  }

  listen() {
    const canvas = this.surface.canvas;
    let drag = null;
    canvas.addEventListener("pointerdown", event => {
      drag = { x: event.offsetX, y: event.offsetY, far: 0 };
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", event => {
      if (!drag) return this.hover(this.nearest(event.offsetX, event.offsetY), event.offsetX, event.offsetY);
      const { t } = this.last ?? {};
      if (!t) return undefined;
      const [dx, dy] = [event.offsetX - drag.x, event.offsetY - drag.y];
      drag.far += Math.hypot(dx, dy);
      if (drag.far > 4) {
        this.view.x -= dx / t.scale;
        this.view.y += dy / t.scale;
        [drag.x, drag.y] = [event.offsetX, event.offsetY];
        this.surface.refresh();
      }
      return undefined;
    });
    canvas.addEventListener("pointerup", event => {
      if (drag && drag.far <= 4) this.select(this.nearest(event.offsetX, event.offsetY));
      drag = null;
    });
    canvas.addEventListener("pointerleave", () => this.hover(-1));
    canvas.addEventListener("wheel", event => {
      event.preventDefault();
      this.zoom(Math.exp(-0.0015 * event.deltaY), event.offsetX, event.offsetY);
    }, { passive: false });
    canvas.addEventListener("dblclick", () => this.reset());
    canvas.addEventListener("keydown", event => {
      const step = 40 / (this.last?.t.scale ?? 1), count = this.geometry?.beams.length ?? 0;
      const acts = {
        "+": () => this.zoom(1.25), "-": () => this.zoom(0.8), 0: () => this.reset(),
        ArrowLeft: () => { this.view.x -= step; }, ArrowRight: () => { this.view.x += step; },
        ArrowUp: () => { this.view.y += step; }, ArrowDown: () => { this.view.y -= step; },
        n: () => this.select((this.selected + 1) % count), p: () => this.select((this.selected - 1 + count) % count), Escape: () => this.select(-1),
      };
      if (!acts[event.key]) return;
      acts[event.key]();
      this.surface.refresh();
      event.preventDefault();
    });
  }
}
