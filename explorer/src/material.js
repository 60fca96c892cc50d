import { tableTexture } from "./gpu.js";
import { written } from "./numbers.js";
import { materialGlsl } from "./shaders/material.js";

// Told apart by colour-blind readers (after Okabe and Ito), on white and on black.
const COLOURS = {
  light: ["#0072b2", "#d55e00", "#008a64", "#c0609a", "#a67c00", "#3a9bd9", "#8a5fd3", "#6f6f6f"],
  dark: ["#4aa3df", "#ff8a3d", "#2fc496", "#e39ac4", "#e0b32e", "#8fd3ff", "#b08cf0", "#b0b0b0"],
};

const flat = (value) => (Array.isArray(value) ? value : [value]);

/** A material as Python describes it, with the numbers set on this page and the uniforms that carry them. */
export class Material {
  constructor(description, entry, index) {
    this.entry = entry; // {text, replaced}: a part of the state
    this.index = index;
    this.take(description);
  }

  /** Takes a new description: after an option changed, the source may be another. */
  take(description) {
    this.dispose();
    Object.assign(this, description);
    this.title = description.title.replace(/\d*\.\d{5,}(e-?\d+)?/g, (number) => written(Number(number)));
    this.values = new Map();
    this.uniforms = {};
    this.passes = new Map();
    this.glslText = null;
    for (const { path, value } of this.parameters ?? []) this.values.set(path, this.entry.replaced[path] ?? value);
    const { glsl } = this;
    if (!glsl) return;
    this.components = componentsOf(glsl.type);
    this.uniforms.page_rgb = { value: Float32Array.from(this.rgb.flat()) };
    this.uniforms.page_channel = { value: -1 };
    for (const one of glsl.arguments) {
      this.values.set(one.path, this.entry.replaced[one.path] ?? this.values.get(one.path) ?? one.value);
      this.uniforms[`page_p_${one.name}`] = { value: null };
      this.carry(one);
    }
    for (const { name, data } of glsl.tables) this.uniforms[name] = { value: tableTexture(data.data) };
    this.glslText = materialGlsl(this);
  }

  get colour() {
    const all = COLOURS[document.documentElement.dataset.theme];
    return all[this.index % all.length];
  }

  get twoSided() {
    return this.sides !== "front";
  }

  has(name) {
    return Boolean(this.glsl?.functions.includes(`${this.glsl.name}_${name}`));
  }

  argument(path) {
    return this.glsl?.arguments.find((one) => one.path === path);
  }

  /** Sets a number; false if the source does not take it as an argument, so that Python must be asked. */
  set(path, value) {
    const argument = this.argument(path);
    if (!argument) return false;
    this.values.set(path, value);
    this.entry.replaced[path] = value;
    this.carry(argument);
    return true;
  }

  carry({ name, path, width }) {
    const value = flat(this.values.get(path));
    const whole = value.length === width ? value : Array(width).fill(value[0]);
    this.uniforms[`page_p_${name}`].value = width === 1 ? whole[0] : whole;
  }

  channelName(k) {
    if (k < 0) return this.components === 1 ? "f" : "luminance";
    const name = this.channel_names?.[k] ?? (this.components === 3 ? "RGB"[k] : `channel ${k}`);
    return typeof name === "number" ? `${name} nm` : name;
  }

  /** The number that plots show, of the values of all channels. */
  scalar(values, channel) {
    if (values.length === 1) return values[0];
    if (channel >= 0) return values[Math.min(channel, values.length - 1)];
    const [r, g, b] = this.linearRgb(values);
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  }

  linearRgb(values) {
    const rgb = this.rgb.flat();
    const sum = [0, 0, 0];
    values.forEach((value, k) => sum.forEach((_, c) => (sum[c] += value * rgb[3 * k + c])));
    return sum;
  }

  dispose() {
    for (const pass of this.passes?.values() ?? []) pass.dispose();
    for (const [name, { value }] of Object.entries(this.uniforms ?? {})) if (!name.startsWith("page_")) value.dispose();
  }
}

function componentsOf(type) {
  if (type === "float") return 1;
  const match = /^vec([234])$|^float\[(\d+)\]$/.exec(type);
  return Number(match[1] ?? match[2]);
}
