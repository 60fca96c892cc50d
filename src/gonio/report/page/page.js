"use strict";
// The page without this script is whole but still: it turns lobes, and writes angles in radians.

const $ = (selector, host = document) => [...host.querySelectorAll(selector)];

// Angles in degrees or radians, numbers and units alike.
function showAngles(inRadians) {
  for (const node of $("[data-deg]")) {
    node.dataset.text ??= node.textContent;
    const degrees = Number(node.dataset.deg);
    const radians = (degrees * Math.PI) / 180;
    const unit = node.closest("svg") ? "" : " rad";
    node.textContent = inRadians ? round(radians) + unit : node.dataset.text;
  }
  for (const node of $("[data-unit]")) node.textContent = inRadians ? "rad" : "°";
  for (const button of $(".units button")) button.setAttribute("aria-pressed", String((button.value === "rad") === inRadians));
  for (const viewer of viewers) viewer.tell(inRadians);
}

const round = (x) => String(Number(x.toPrecision(4))).replace("-", "−");

// Light or dark, as the system has it until somebody chooses.
function showTheme(theme) {
  document.documentElement.dataset.theme = theme;
  for (const viewer of viewers) viewer.draw();
}

const system = matchMedia("(prefers-color-scheme: dark)");
const isDark = () => (document.documentElement.dataset.theme ?? (system.matches ? "dark" : "light")) === "dark";

// Lobes: a grid of directions with log10 f in 16 bits, drawn by a rasterizer of our own into a canvas.
class Viewer {
  constructor(host) {
    this.host = host;
    this.data = JSON.parse(host.querySelector("script").textContent);
    this.canvas = host.querySelector("canvas");
    this.slider = host.querySelector("input[type=range]");
    this.log = host.querySelector("select");
    this.said = host.querySelector("output");
    this.turn = { yaw: -0.32, pitch: 0.42 };
    this.meshes = new Map();
    this.inRadians = false;
    this.frame = 0;
    this.slider.max = String(this.data.lobes.length - 1);
    this.slider.value = String(Math.max(0, this.data.lobes.findIndex((lobe) => lobe.theta_i >= 44)));
    this.slider.addEventListener("input", () => this.later());
    this.log.addEventListener("change", () => this.later());
    this.listen();
    this.draw();
    new ResizeObserver(() => this.later()).observe(this.canvas);
  }

  listen() {
    const canvas = this.canvas;
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.held = { x: event.clientX, y: event.clientY };
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!this.held) return;
      this.rotate((event.clientX - this.held.x) * 0.01, (event.clientY - this.held.y) * 0.01);
      this.held = { x: event.clientX, y: event.clientY };
    });
    for (const end of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(end, () => {
        this.held = null;
        this.later();
      });
    }
    canvas.addEventListener("dblclick", () => this.reset());
    canvas.addEventListener("keydown", (event) => {
      const steps = { ArrowLeft: [-0.12, 0], ArrowRight: [0.12, 0], ArrowUp: [0, -0.12], ArrowDown: [0, 0.12] };
      if (event.key in steps) this.rotate(...steps[event.key]);
      else if (event.key === "Home") this.reset();
      else if (event.key === "+" || event.key === "-") {
        this.slider.value = String(Number(this.slider.value) + (event.key === "+" ? 1 : -1));
        this.later();
      } else return;
      event.preventDefault();
    });
  }

  rotate(yaw, pitch) {
    this.turn.yaw += yaw;
    const least = this.data.lobes[0].through ? -1.5 : -0.1;
    this.turn.pitch = Math.min(1.55, Math.max(least, this.turn.pitch + pitch));
    this.later();
  }

  reset() {
    this.turn = { yaw: -0.32, pitch: 0.42 };
    this.later();
  }

  later() {
    if (!this.frame) {
      this.frame = requestAnimationFrame(() => {
        this.frame = 0;
        this.draw();
      });
    }
  }

  tell(inRadians) {
    this.inRadians = inRadians;
    this.words();
  }

  words() {
    const lobe = this.data.lobes[Number(this.slider.value)];
    const angle = this.inRadians ? `${round((lobe.theta_i * Math.PI) / 180)} rad` : `${round(lobe.theta_i)}°`;
    const peak = [lobe.peak, lobe.peak_through].filter((x) => x !== undefined && x !== null);
    const f = peak.length ? `largest f ${round(Math.max(...peak))} sr⁻¹` : "no data";
    const shares = ["reflected", "transmitted"].map((word, k) => (lobe.delta?.[k] > 0 ? `${round(lobe.delta[k])} ${word}` : ""));
    const delta = lobe.delta ? `; without scattering: ${shares.filter(Boolean).join(", ")}` : "";
    this.said.textContent = `${angle}: ${f}${delta}`;
    this.slider.setAttribute("aria-valuetext", angle);
  }

  // Vertices, faces and colours of a lobe at one kind of radius.
  mesh(index, log) {
    const key = `${index} ${log}`;
    if (this.meshes.has(key)) return this.meshes.get(key);
    const lobe = this.data.lobes[index];
    const parts = [this.part(lobe, lobe.codes, 1, log)];
    if (lobe.through) parts.push(this.part(lobe, lobe.through, -1, log));
    this.meshes.set(key, parts);
    return parts;
  }

  part(lobe, text, up, log) {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    const codes = new Uint16Array(bytes.buffer);
    const { low, high, floor } = this.data;
    const rows = lobe.polar.length;
    const columns = lobe.around.length;
    const points = new Float32Array(codes.length * 3);
    const shares = new Float32Array(codes.length);
    const largest = Math.max(lobe.peak || 0, lobe.peak_through || 0) || 1;
    for (let i = 0; i < rows; i++) {
      const t = (lobe.polar[i] * Math.PI) / 180;
      for (let j = 0; j < columns; j++) {
        const p = (lobe.around[j] * Math.PI) / 180;
        const k = i * columns + j;
        const power = floor + ((codes[k] - 1) / 65534) * (high - floor);
        const share = (power - low) / (high - low);
        shares[k] = codes[k] ? Math.max(0, share) : -1;
        const r = codes[k] ? Math.max(0, log ? share : 10 ** power / largest) : 0;
        points[3 * k] = r * Math.sin(t) * Math.cos(p);
        points[3 * k + 1] = r * Math.sin(t) * Math.sin(p);
        points[3 * k + 2] = up * r * Math.cos(t);
      }
    }
    return { rows, columns, points, shares, up };
  }

  draw() {
    const scale = Math.min(2, window.devicePixelRatio || 1) * (this.held ? 1 : 1.5);
    const width = Math.max(160, Math.round(this.canvas.clientWidth * scale));
    const height = Math.max(120, Math.round(this.canvas.clientHeight * scale));
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
    const index = Number(this.slider.value);
    const log = this.log.value === "log";
    const picture = new Raster(width, height, this.turn, this.data.lobes[0].through ? 0 : 0.4, isDark());
    const lobe = this.data.lobes[index];
    for (const part of this.mesh(index, log)) picture.surface(part);
    this.lines(picture, lobe, log);
    const context = this.canvas.getContext("2d");
    context.putImageData(picture.image, 0, 0);
    this.labels(context, picture, log);
    this.words();
  }

  lines(picture, lobe, log) {
    const ring = (r, c) => {
      const points = Array.from({ length: 97 }, (_, k) => [r * Math.cos((k * Math.PI) / 48), r * Math.sin((k * Math.PI) / 48), 0]);
      picture.polyline(points, c, 1);
    };
    for (const [r] of this.rings(log)) ring(r, picture.ink.ring);
    ring(1, picture.ink.rim);
    picture.polyline([[-1, 0, 0], [1, 0, 0]], picture.ink.ring, 1);
    picture.polyline([[0, -1, 0], [0, 1, 0]], picture.ink.ring, 1);
    const t = (lobe.theta_i * Math.PI) / 180;
    const [s, c] = [Math.sin(t), Math.cos(t)];
    picture.arrow([-1.3 * s, 0, 1.3 * c], [-0.02 * s, 0, 0.02 * c], picture.ink.light, 2.2);
    picture.polyline([[0, 0, 0], [1.2 * s, 0, 1.2 * c]], picture.ink.mirror, 1);
    if (lobe.delta && lobe.delta[0] > 0) picture.arrow([0, 0, 0], [1.2 * s, 0, 1.2 * c], picture.ink.delta, 3.2);
    if (lobe.delta && lobe.delta[1] > 0) picture.arrow([0, 0, 0], [1.2 * s, 0, -1.2 * c], picture.ink.delta, 3.2);
    picture.polyline([[0, 0, 0], [0, 0, 1.15]], picture.ink.ring, 1);
  }

  // Radii of powers of ten, or of shares of the largest f, with their names.
  rings(log) {
    if (!log) return [[0.25, ""], [0.5, "½ of the largest"], [0.75, ""]];
    const { low, high, lobes } = this.data;
    const found = [];
    if (!lobes.some((lobe) => Math.max(lobe.peak ?? 0, lobe.peak_through ?? 0) > 0)) return found; // mirrors
    for (let d = Math.floor(low); d <= high; d++) {
      const steps = high - low < 1.5 ? [1, 2, 5] : [1];
      for (const step of steps) {
        const r = (d + Math.log10(step) - low) / (high - low);
        if (r > 0.03 && r <= 1) found.push([r, steps.length > 1 ? round(step * 10 ** d) : `10${superscript(d)}`]);
      }
    }
    return found;
  }

  labels(context, picture, log) {
    const style = getComputedStyle(this.canvas);
    const size = Math.round((12 * picture.width) / this.canvas.clientWidth);
    context.font = `${size}px ${style.fontFamily}`;
    context.fillStyle = style.color;
    context.textAlign = "center";
    const azimuth = -Math.PI / 2 - this.turn.yaw - 0.7; // in front, to the left, however it is turned
    for (const [r, name] of this.rings(log)) {
      if (!name || r < 0.1) continue;
      const at = picture.place(r * Math.cos(azimuth), r * Math.sin(azimuth), 0);
      context.fillText(name, at[0], at[1] + size);
    }
    const lobe = this.data.lobes[Number(this.slider.value)];
    const t = (lobe.theta_i * Math.PI) / 180;
    const light = picture.place(-1.36 * Math.sin(t), 0, 1.36 * Math.cos(t));
    context.fillText("light", light[0], light[1]);
    const mirror = picture.place(1.28 * Math.sin(t), 0, 1.28 * Math.cos(t));
    if (lobe.theta_i > 4) context.fillText("mirror", mirror[0], mirror[1]);
  }
}

const superscript = (d) => String(d).replace(/[-0-9]/g, (c) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(c)]);

// Triangles and lines with a depth for each pixel, seen by a parallel camera.
class Raster {
  constructor(width, height, turn, middle, dark) {
    Object.assign(this, { width, height });
    this.image = new ImageData(width, height);
    this.depth = new Float32Array(width * height).fill(-1e9);
    this.zoom = Math.min(width / 2.75, height / (middle ? 2.0 : 2.85));
    this.middle = middle;
    const [cy, sy, cp, sp] = [Math.cos(turn.yaw), Math.sin(turn.yaw), Math.cos(turn.pitch), Math.sin(turn.pitch)];
    this.axes = [[cy, -sy, 0], [sy * sp, cy * sp, cp], [-sy * cp, -cy * cp, sp]];
    this.ink = dark
      ? { ring: [110, 120, 130], rim: [150, 160, 170], light: [245, 190, 80], mirror: [150, 160, 170], delta: [240, 110, 80] }
      : { ring: [175, 180, 186], rim: [120, 126, 132], light: [205, 130, 10], mirror: [110, 116, 122], delta: [200, 60, 20] };
  }

  seen(x, y, z) {
    const [a, b, c] = this.axes;
    return [a[0] * x + a[1] * y + a[2] * z, b[0] * x + b[1] * y + b[2] * z, c[0] * x + c[1] * y + c[2] * z];
  }

  place(x, y, z) {
    const [u, v, w] = this.seen(x, y, z);
    return [this.width / 2 + this.zoom * u, this.height / 2 - this.zoom * (v - this.middle * this.axes[1][2]), w];
  }

  surface({ rows, columns, points, shares }) {
    const count = rows * columns;
    const at = new Float32Array(count * 3);
    const normals = new Float32Array(count * 3);
    for (let k = 0; k < count; k++) at.set(this.place(points[3 * k], points[3 * k + 1], points[3 * k + 2]), 3 * k);
    const faces = [];
    for (let i = 0; i + 1 < rows; i++) {
      for (let j = 0; j + 1 < columns; j++) {
        const a = i * columns + j;
        const quad = [a, a + columns, a + columns + 1, a + 1];
        if (quad.some((k) => shares[k] < 0)) continue;
        faces.push([quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]);
      }
    }
    for (const [a, b, c] of faces) {
      const [ux, uy, uz] = [at[3 * b] - at[3 * a], at[3 * b + 1] - at[3 * a + 1], (at[3 * b + 2] - at[3 * a + 2]) * this.zoom];
      const [vx, vy, vz] = [at[3 * c] - at[3 * a], at[3 * c + 1] - at[3 * a + 1], (at[3 * c + 2] - at[3 * a + 2]) * this.zoom];
      const n = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
      if (n[2] < 0) n.forEach((x, k) => (n[k] = -x)); // towards the camera
      for (const k of [a, b, c]) for (let d = 0; d < 3; d++) normals[3 * k + d] += n[d];
    }
    const light = new Float32Array(count);
    for (let k = 0; k < count; k++) {
      const [x, y, z] = [normals[3 * k], normals[3 * k + 1], normals[3 * k + 2]];
      const length = Math.hypot(x, y, z) || 1;
      const key = Math.max(0, (-0.45 * x - 0.6 * y + 0.66 * z) / length);
      light[k] = 0.56 + 0.5 * key + 0.35 * key ** 24;
    }
    const colours = new Float32Array(count * 3);
    for (let k = 0; k < count; k++) colours.set(ramp(shares[k]), 3 * k);
    for (const face of faces) this.triangle(at, light, colours, face);
  }

  triangle(at, light, colours, [a, b, c]) {
    const [ax, ay, az] = [at[3 * a], at[3 * a + 1], at[3 * a + 2]];
    const [bx, by, bz] = [at[3 * b], at[3 * b + 1], at[3 * b + 2]];
    const [cx, cy, cz] = [at[3 * c], at[3 * c + 1], at[3 * c + 2]];
    const area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay);
    if (Math.abs(area) < 1e-9) return;
    const [left, right] = [Math.max(0, Math.floor(Math.min(ax, bx, cx))), Math.min(this.width - 1, Math.ceil(Math.max(ax, bx, cx)))];
    const [top, foot] = [Math.max(0, Math.floor(Math.min(ay, by, cy))), Math.min(this.height - 1, Math.ceil(Math.max(ay, by, cy)))];
    const pixels = this.image.data;
    for (let y = top; y <= foot; y++) {
      for (let x = left; x <= right; x++) {
        const v = ((x + 0.5 - ax) * (cy - ay) - (cx - ax) * (y + 0.5 - ay)) / area;
        const w = ((bx - ax) * (y + 0.5 - ay) - (x + 0.5 - ax) * (by - ay)) / area;
        const u = 1 - v - w;
        if (u < -1e-4 || v < -1e-4 || w < -1e-4) continue;
        const k = y * this.width + x;
        const depth = u * az + v * bz + w * cz;
        if (depth <= this.depth[k]) continue;
        this.depth[k] = depth;
        const shade = u * light[a] + v * light[b] + w * light[c];
        for (let d = 0; d < 3; d++) {
          pixels[4 * k + d] = shade * (u * colours[3 * a + d] + v * colours[3 * b + d] + w * colours[3 * c + d]);
        }
        pixels[4 * k + 3] = 255;
      }
    }
  }

  polyline(points, colour, width) {
    const half = (width * Math.min(this.width, 1.9 * this.height)) / 1500;
    for (let k = 0; k + 1 < points.length; k++) {
      const [a, b] = [this.place(...points[k]), this.place(...points[k + 1])];
      const steps = Math.ceil(Math.hypot(b[0] - a[0], b[1] - a[1]) * 1.5) || 1;
      for (let s = 0; s <= steps; s++) {
        const t = s / steps;
        this.dot(a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2]), half, colour);
      }
    }
  }

  arrow(from, to, colour, width) {
    this.polyline([from, to], colour, width);
    const d = to.map((x, k) => x - from[k]);
    const length = Math.hypot(...d);
    const back = to.map((x, k) => x - (0.09 * d[k]) / length);
    for (const side of [[0, 1, 0], [0, -1, 0], [d[2] / length, 0, -d[0] / length], [-d[2] / length, 0, d[0] / length]]) {
      this.polyline([to, back.map((x, k) => x + 0.035 * side[k])], colour, width);
    }
  }

  dot(x, y, z, half, colour) {
    const [left, right, top, foot] = [Math.round(x - half), Math.round(x + half), Math.round(y - half), Math.round(y + half)];
    for (let j = Math.max(0, top); j <= Math.min(this.height - 1, foot); j++) {
      for (let i = Math.max(0, left); i <= Math.min(this.width - 1, right); i++) {
        const k = j * this.width + i;
        if (z + 0.004 < this.depth[k]) continue;
        this.depth[k] = z;
        this.image.data.set([...colour, 255], 4 * k);
      }
    }
  }
}

// Colours from low to high that people tell apart whatever colours they see.
const STOPS = [[20, 58, 110], [33, 104, 130], [60, 145, 130], [150, 180, 100], [235, 200, 80], [250, 232, 140]];

function ramp(share) {
  const at = Math.min(1, Math.max(0, share)) * (STOPS.length - 1);
  const k = Math.min(STOPS.length - 2, Math.floor(at));
  return STOPS[k].map((x, d) => x + (STOPS[k + 1][d] - x) * (at - k));
}

const viewers = [];
document.documentElement.classList.add("scripted");
for (const host of $(".lobe")) viewers.push(new Viewer(host));
for (const button of $(".units button")) button.addEventListener("click", () => showAngles(button.value === "rad"));
for (const button of $("[data-do=theme]")) button.addEventListener("click", () => showTheme(isDark() ? "light" : "dark"));
for (const button of $("[data-do=print]")) button.addEventListener("click", () => window.print());
for (const button of $("[data-do=copy]")) {
  button.addEventListener("click", async () => {
    const text = button.parentElement.querySelector("code").textContent;
    try {
      await navigator.clipboard.writeText(text);
    } catch {
      const range = document.createRange();
      range.selectNodeContents(button.parentElement.querySelector("code"));
      getSelection().removeAllRanges();
      getSelection().addRange(range);
      document.execCommand("copy");
    }
    button.textContent = "copied";
    setTimeout(() => (button.textContent = "copy"), 1500);
  });
}
system.addEventListener("change", () => viewers.forEach((viewer) => viewer.draw()));
addEventListener("beforeprint", () => $("details").forEach((node) => { node.dataset.was = String(node.open); node.open = true; }));
addEventListener("afterprint", () => $("details").forEach((node) => (node.open = node.dataset.was === "true")));
