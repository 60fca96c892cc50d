import { element } from "./dom.js";
import { power10, ticks, written } from "./numbers.js";

/** What charts share: a canvas with a cursor (pointer or arrow keys) and the values under it as text below. */
class Chart {
  constructor(label, testid) {
    this.canvas = element("canvas", { tabindex: 0, role: "img", "aria-label": label, "data-testid": testid });
    this.readout = element("div", { class: "readout" });
    this.curves = [];
    this.cursor = null;
    this.canvas.addEventListener("pointermove", (event) => this.point(event));
    this.canvas.addEventListener("pointerdown", (event) => this.point(event));
    this.canvas.addEventListener("keydown", (event) => this.key(event));
  }

  point(event) {
    const box = this.canvas.getBoundingClientRect();
    this.cursor = this.abscissa(event.clientX - box.left, event.clientY - box.top);
    this.paint();
  }

  key(event) {
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (event.key === "Escape") this.cursor = null;
    else if (!step) return;
    else this.cursor = (this.cursor ?? 0) + step * this.step * (event.shiftKey ? 10 : 1);
    event.preventDefault();
    this.paint();
  }

  /** `format` writes an abscissa; curves: {x, y, name, colour, dash, width, faint}. */
  set(fields) {
    Object.assign(this, fields);
    this.paint();
  }

  begin() {
    const { canvas } = this;
    const ratio = Math.min(devicePixelRatio, 2);
    this.width = canvas.clientWidth;
    this.height = canvas.clientHeight;
    if (canvas.width !== Math.round(this.width * ratio) || canvas.height !== Math.round(this.height * ratio)) {
      canvas.width = Math.round(this.width * ratio);
      canvas.height = Math.round(this.height * ratio);
    }
    const style = getComputedStyle(document.documentElement);
    const get = (name) => style.getPropertyValue(name).trim();
    this.ink = { text: get("--muted"), line: get("--grid"), strong: get("--ink") };
    const drawing = canvas.getContext("2d", { willReadFrequently: true }); // long curves are drawn faster by the processor
    drawing.setTransform(ratio, 0, 0, ratio, 0, 0);
    drawing.clearRect(0, 0, this.width, this.height);
    drawing.font = "11px system-ui, sans-serif";
    drawing.lineJoin = "round";
    return drawing;
  }

  /** Ends of the ordinate: from 0, or in a logarithmic plot six decades at most. */
  ordinate() {
    let high = 0;
    let low = Infinity;
    for (const { x, y } of this.curves) for (let k = 0; k < y.length; k++) {
      if (this.counts && !this.counts(x[k])) continue;
      if (y[k] > high) high = y[k];
      if (y[k] > 0 && y[k] < low) low = y[k];
    }
    if (!(high > 0)) [low, high] = [0.1, 1];
    if (this.scale !== "log") return [0, this.top ?? high * 1.06];
    const top = Math.ceil(Math.log10(high) + 0.02);
    return [10 ** Math.max(Math.min(Math.floor(Math.log10(low)), top - 1), top - 6), 10 ** top];
  }

  /** Share of the ordinate's way, from 0 to 1. */
  share(value) {
    const [low, high] = this.range;
    if (this.scale === "log") return Math.log(Math.max(value, low) / low) / Math.log(high / low);
    return (value - low) / (high - low);
  }

  levels(count) {
    const [low, high] = this.range;
    if (this.scale !== "log") return ticks(low, high, count).map((value) => [value, written(value, 3)]);
    const all = [];
    for (let k = Math.round(Math.log10(low)); k <= Math.round(Math.log10(high)); k++) all.push([10 ** k, power10(k)]);
    return all;
  }

  stroke(drawing, curve, place) {
    drawing.strokeStyle = curve.colour;
    drawing.lineWidth = curve.width ?? 1.75;
    drawing.globalAlpha = curve.faint ?? 1;
    drawing.setLineDash(curve.dash ?? []);
    drawing.beginPath();
    let open = false;
    for (let k = 0; k < curve.x.length; k++) {
      if (Number.isNaN(curve.y[k])) {
        open = false;
        continue;
      }
      const [px, py] = place(curve.x[k], curve.y[k]);
      if (open) drawing.lineTo(px, py);
      else drawing.moveTo(px, py);
      open = true;
    }
    drawing.stroke();
    drawing.setLineDash([]);
    drawing.globalAlpha = 1;
  }

  values() {
    return this.curves.map((curve) => ({ curve, value: interpolated(curve, this.cursor) }));
  }

  tell() {
    if (this.cursor === null || !this.curves.length) {
      const legend = this.curves.filter(({ name, faint }) => name && faint !== 0).map((curve) => element("span", { class: "value" }, sample(curve), curve.name));
      this.readout.replaceChildren(...legend, element("span", { class: "hint" }, this.hint ?? ""));
      return;
    }
    const rows = this.values()
      .filter(({ value }) => value !== null)
      .map(({ curve, value }) => element("span", { class: "value" }, sample(curve), `${curve.name} `, element("b", {}, written(value, 5))));
    this.readout.replaceChildren(element("span", { class: "where" }, this.format(this.cursor)), ...rows);
  }
}

/** A piece of a curve for the legend. */
function sample({ colour, dash, width, faint }) {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("width", "26");
  svg.setAttribute("height", "8");
  const piece = document.createElementNS("http://www.w3.org/2000/svg", "path");
  const drawn = { d: "M0 4H26", stroke: colour, "stroke-width": width ?? 1.75, "stroke-dasharray": (dash ?? []).join(" "), opacity: faint ?? 1 };
  for (const [name, value] of Object.entries(drawn)) piece.setAttribute(name, value);
  svg.append(piece);
  return svg;
}

function interpolated({ x, y }, at) {
  if (!(at >= x[0] && at <= x[x.length - 1])) return null;
  let [low, high] = [0, x.length - 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (x[middle] <= at) low = middle;
    else high = middle;
  }
  const share = x[high] === x[low] ? 0 : (at - x[low]) / (x[high] - x[low]);
  return y[low] + share * (y[high] - y[low]);
}

export class CartesianChart extends Chart {
  step = 1;

  paint() {
    const drawing = this.begin();
    this.range = this.ordinate();
    const [left, right, top, bottom] = [54, 14, 12, 38];
    this.box = { left, width: this.width - left - right, top, height: this.height - top - bottom };
    const { box, ink } = this;
    const px = (x) => left + ((x - this.from) / (this.to - this.from)) * box.width;
    const py = (y) => top + (1 - this.share(y)) * box.height;
    drawing.fillStyle = ink.text;
    drawing.strokeStyle = ink.line;
    drawing.lineWidth = 1;
    drawing.textAlign = "right";
    drawing.textBaseline = "middle";
    for (const [value, text] of this.levels(Math.max(2, box.height / 44))) {
      const y = Math.round(py(value)) + 0.5;
      line(drawing, left, y, left + box.width, y);
      drawing.fillText(text, left - 6, y);
    }
    drawing.textAlign = "center";
    drawing.textBaseline = "top";
    for (const [value, text] of this.marks) {
      const x = Math.round(px(value)) + 0.5;
      line(drawing, x, top, x, top + box.height);
      drawing.fillText(text, x, top + box.height + 5);
    }
    drawing.fillText(this.label, left + box.width / 2, this.height - 15);
    drawing.save();
    drawing.translate(11, top + box.height / 2);
    drawing.rotate(-Math.PI / 2);
    drawing.textBaseline = "middle";
    drawing.fillText(this.ordinateLabel, 0, 0);
    drawing.restore();
    drawing.save();
    drawing.beginPath();
    drawing.rect(left, top - 2, box.width, box.height + 4);
    drawing.clip();
    this.fill?.(drawing, px, py);
    for (const curve of this.curves) this.stroke(drawing, curve, (x, y) => [px(x), py(y)]);
    if (this.cursor !== null) {
      this.cursor = Math.min(Math.max(this.cursor, this.from), this.to);
      drawing.strokeStyle = ink.strong;
      drawing.globalAlpha = 0.5;
      line(drawing, px(this.cursor), top, px(this.cursor), top + box.height);
      drawing.globalAlpha = 1;
      for (const { curve, value } of this.values()) if (value !== null) dot(drawing, px(this.cursor), py(value), curve.colour);
    }
    drawing.restore();
    this.tell();
  }

  abscissa(x) {
    return this.from + ((x - this.box.left) / this.box.width) * (this.to - this.from);
  }
}

/** f as the radius, the angle from the normal, which points up; `whole` shows what is below the horizon too. */
export class PolarChart extends Chart {
  step = 1;

  paint() {
    const drawing = this.begin();
    this.range = this.ordinate();
    const below = this.whole ? 1 : 0;
    const radius = Math.max(20, Math.min((this.width - 76) / 2, (this.height - 52) / (1 + below)));
    this.centre = [this.width / 2, this.whole ? this.height / 2 : (this.height + radius) / 2 + 2];
    const [cx, cy] = this.centre;
    const place = (angle, share) => {
      const a = (angle * Math.PI) / 180;
      return [cx + radius * share * Math.sin(a), cy - radius * share * Math.cos(a)];
    };
    const { ink } = this;
    const end = this.whole ? 180 : 90;
    drawing.strokeStyle = ink.line;
    drawing.fillStyle = ink.text;
    drawing.lineWidth = 1;
    const levels = this.levels(3);
    for (const [value] of [...levels, [this.range[1], ""]]) {
      const share = Math.min(1, this.share(value));
      drawing.beginPath();
      drawing.arc(cx, cy, radius * share, this.whole ? -Math.PI : Math.PI, this.whole ? Math.PI : 2 * Math.PI);
      drawing.stroke();
    }
    drawing.textAlign = "center";
    drawing.textBaseline = "middle";
    for (let angle = -end; angle <= end; angle += 30) {
      if (angle === -180) continue;
      line(drawing, cx, cy, ...place(angle, 1));
      drawing.fillText(this.mark(angle), ...place(angle, 1 + 15 / radius));
    }
    for (const curve of this.curves) this.stroke(drawing, curve, (angle, y) => place(angle, Math.min(this.share(y), 1.08)));
    for (const { angle, colour } of this.arrows ?? []) {
      drawing.strokeStyle = colour;
      drawing.fillStyle = colour;
      drawing.lineWidth = 1.25;
      drawing.setLineDash([2, 3]);
      line(drawing, ...place(angle, 1), cx, cy);
      drawing.setLineDash([]);
      arrowHead(drawing, place(angle, 0.9), place(angle, 1));
    }
    drawing.textBaseline = "top";
    drawing.textAlign = "left";
    drawing.font = "10px system-ui, sans-serif";
    if (!this.whole) for (const [value, text] of levels) {
      const share = this.share(value);
      if (share > 0.08 && share <= 1) { drawing.fillStyle = ink.text; drawing.fillText(text, cx + radius * share - 4, cy + 16); }
    }
    if (this.cursor !== null) {
      this.cursor = Math.min(Math.max(this.cursor, -end), end);
      drawing.strokeStyle = ink.strong;
      drawing.globalAlpha = 0.45;
      line(drawing, cx, cy, ...place(this.cursor, 1));
      drawing.globalAlpha = 1;
      for (const { curve, value } of this.values()) if (value !== null) dot(drawing, ...place(this.cursor, Math.max(0, this.share(value))), curve.colour);
    }
    this.tell();
  }

  abscissa(x, y) {
    return (Math.atan2(x - this.centre[0], this.centre[1] - y) * 180) / Math.PI;
  }
}

function line(drawing, x0, y0, x1, y1) {
  drawing.beginPath();
  drawing.moveTo(x0, y0);
  drawing.lineTo(x1, y1);
  drawing.stroke();
}

function dot(drawing, x, y, colour) {
  drawing.fillStyle = colour;
  drawing.beginPath();
  drawing.arc(x, y, 3.5, 0, 2 * Math.PI);
  drawing.fill();
}

function arrowHead(drawing, [x, y], [fromX, fromY]) {
  const size = Math.hypot(x - fromX, y - fromY) || 1;
  const [dx, dy] = [(x - fromX) / size, (y - fromY) / size];
  drawing.beginPath();
  drawing.moveTo(x + 5 * dx, y + 5 * dy);
  drawing.lineTo(x - 4 * dx - 4 * dy, y - 4 * dy + 4 * dx);
  drawing.lineTo(x - 4 * dx + 4 * dy, y - 4 * dy - 4 * dx);
  drawing.fill();
}
