// Draws a mechanism that moves. D holds what was drawn and how it moves; see animation.rs.
const canvas = document.querySelector("canvas"), c = canvas.getContext("2d"), $ = id => document.getElementById(id);
const [lowX, lowY, highX, highY] = D.bounds;
let scale = 1, left = 0, bottom = 0, playing = true, frame = 0, last = 0;
const X = x => left + (x - lowX) * scale, Y = y => bottom - (y - lowY) * scale;

function fit() {
  const ratio = window.devicePixelRatio || 1, wide = canvas.clientWidth;
  const tall = Math.max(200, Math.min(window.innerHeight - 190, wide * (highY - lowY) / (highX - lowX)));
  canvas.style.height = tall + "px";
  canvas.width = wide * ratio;
  canvas.height = tall * ratio;
  c.setTransform(ratio, 0, 0, ratio, 0, 0);
  scale = Math.min(wide / (highX - lowX), tall / (highY - lowY));
  left = (wide - (highX - lowX) * scale) / 2;
  bottom = tall - (tall - (highY - lowY) * scale) / 2;
}

// Displacement of point i: a frame of the motion, or a mode shape times its phase.
function motionAt(time) {
  if (D.time) {
    const k = Math.min(Math.floor(time), D.frames.length - 2), s = Math.min(time - k, 1);
    const a = D.frames[Math.max(k, 0)], b = D.frames[Math.max(k, 0) + 1] || a;
    return (i, d) => (a[3 * i + d] + s * (b[3 * i + d] - a[3 * i + d])) * D.unit[d];
  }
  const a = D.frames[frame], s = Math.sin(time);
  return (i, d) => a[3 * i + d] * D.unit[d] * s;
}

function draw(move, factor, rest, moved) {
  const at = i => [D.points[i][0] + factor * move(i, 0), D.points[i][1] + factor * move(i, 1)];
  c.lineWidth = 2;
  c.strokeStyle = moved || rest;
  for (const [a, b] of D.links) {
    c.beginPath();
    c.moveTo(X(at(a)[0]), Y(at(a)[1]));
    c.lineTo(X(at(b)[0]), Y(at(b)[1]));
    c.stroke();
  }
  c.fillStyle = moved || rest;
  for (const body of D.bodies) {
    const [x, y] = at(body.at), t = Math.atan(factor * move(body.at, 2)), cos = Math.cos(t), sin = Math.sin(t);
    c.beginPath();
    for (const [u, v] of body.shape) c.lineTo(X(x + cos * u - sin * v), Y(y + sin * u + cos * v));
    c.closePath();
    c.fill();
  }
  for (const beam of D.beams) {
    const n = beam.p.length - 1, a = D.points[beam.p[0]], b = D.points[beam.p[n]];
    const dx = (b[0] - a[0]) / n, dy = (b[1] - a[1]) / n;
    c.beginPath();
    c.lineWidth = Math.max(beam.w * scale, 1.2);
    for (let k = 0; k <= n; k++) {
      const i = beam.p[k], [x, y] = at(i), t = factor * move(i, 2), tx = (dx - t * dy) / 3, ty = (dy + t * dx) / 3;
      if (k === 0) c.moveTo(X(x), Y(y));
      else {
        const [px, py, ux, uy] = draw.before;
        c.bezierCurveTo(X(px + ux), Y(py + uy), X(x - tx), Y(y - ty), X(x), Y(y));
      }
      draw.before = [x, y, tx, ty];
    }
    c.stroke();
  }
}

function paint(time) {
  c.clearRect(0, 0, canvas.width, canvas.height);
  c.strokeStyle = "#777";
  c.lineWidth = 1;
  for (const shape of D.fixed) {
    c.fillStyle = shape.pad ? "#efefef" : "#d0d0d0";
    c.beginPath();
    for (const [x, y] of shape.shape) c.lineTo(X(x), Y(y));
    c.closePath();
    c.fill();
    if (shape.pad) c.stroke();
  }
  const factor = D.factor * Math.pow(10, $("factor").value / 50);
  draw(() => 0, 1, "#d0d0d0");
  c.globalAlpha = 0.88;
  draw(motionAt(time), factor, "", "#0072B2");
  c.globalAlpha = 1;
  if (D.time) {
    $("label").textContent = D.labels[Math.round(time)];
    $("times").textContent = "displacements × " + factor.toPrecision(2);
  } else $("label").textContent = D.labels[frame];
}

let now = 0;
function tick(stamp) {
  const passed = Math.min(stamp - last, 100) / 1000;
  last = stamp;
  if (playing) {
    now += D.time ? passed * (D.frames.length - 1) / 8 : passed * 4;
    if (D.time) {
      now %= D.frames.length - 1;
      $("slider").value = now;
    }
  }
  paint(now);
  requestAnimationFrame(tick);
}

$("play").onclick = () => { playing = !playing; $("play").textContent = playing ? "Pause" : "Play"; };
$("slider").oninput = e => {
  if (D.time) {
    now = +e.target.value;
    playing = false;
    $("play").textContent = "Play";
  } else frame = +e.target.value;
};
$("slider").max = D.frames.length - 1;
$("slider").step = D.time ? "any" : 1;
$("slider").value = 0;
if (D.frames.length < 2) $("slider").style.visibility = "hidden";
window.onresize = fit;
fit();
requestAnimationFrame(tick);
