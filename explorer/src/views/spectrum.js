import { element, labelled, select } from "../dom.js";
import { CartesianChart } from "../chart.js";
import { direction, mirror } from "../directions.js";
import { evaluate, gridOf } from "../evaluate.js";
import { ticks, written } from "../numbers.js";
import { View } from "./view.js";
import { framed } from "./plots.js";

const PLACES = { mirror: "mirror direction", normal: "normal", light: "light's direction" };

/** f and albedo by channel, and the colour that they make. */
export class Spectrum extends View {
  static key = "spectrum";
  static title = "Spectrum and colour";

  constructor(app) {
    super(app);
    this.chart = new CartesianChart("f by channel", "spectrum");
    this.patches = element("div", { class: "patches" });
    this.body.append(this.chart.canvas, this.chart.readout, this.patches);
    this.bar.append(labelled("f towards", select(Object.entries(PLACES), app.state.spectrum, (value) => { app.state.spectrum = value; app.change("view", null, this); })));
    this.values = new Map();
  }

  changed(kind, material) {
    if (["materials", "values", "incidence"].includes(kind)) this.app.albedos.changed(material);
    super.changed();
  }

  draw() {
    const waiting = this.app.albedos.bring(() => this.app.albedoViews().forEach((view) => view.changed("curves")));
    this.bring();
    const shown = this.app.materials.filter((one) => this.values.has(one));
    const axis = shown.map(axisOf);
    const waves = axis.length > 0 && axis.every(({ waves }) => waves);
    const from = Math.min(...axis.map(({ x }) => x[0])) - (waves ? 0 : 0.6);
    const to = Math.max(...axis.map(({ x }) => x[x.length - 1])) + (waves ? 0 : 0.6);
    const names = shown.reduce((most, one) => (one.components > most.length ? axisOf(one).names : most), []);
    this.chart.set({
      curves: shown.map((material, k) => ({ x: axis[k].x.length > 1 ? axis[k].x : [axis[k].x[0] - 0.4, axis[k].x[0] + 0.4], y: axis[k].x.length > 1 ? this.values.get(material) : Array(2).fill(this.values.get(material)[0]), colour: material.colour, name: material.title.slice(0, 30), faint: waves ? 1 : 0 })),
      from: shown.length ? from : 0, to: shown.length ? (to > from ? to : from + 1) : 1, scale: "linear",
      marks: waves ? ticks(from, to, 6).map((x) => [x, String(x)]) : names.map((name, k) => [k, name]),
      label: waves ? "wavelength [nm]" : "channel",
      ordinateLabel: "f [sr⁻¹]",
      format: (x) => (waves ? `${written(x, 4)} nm` : names[Math.round(x)] ?? ""),
      hint: "Point, or press ← →, to read.",
      fill: waves ? null : (drawing, px, py) => bars(drawing, px, py, shown.map((material) => ({ colour: material.colour, y: this.values.get(material) }))),
    });
    this.patch(shown);
    return waiting;
  }

  patch(shown) {
    const { theta } = this.app.state;
    this.patches.replaceChildren(
      ...shown.map((material) => {
        const albedo = this.app.albedos.at(material, theta);
        if (!albedo) return element("div", {});
        const rgb = material.linearRgb(albedo.reflected);
        const css = `rgb(${rgb.map((x) => Math.round(255 * srgb(x))).join(" ")})`;
        const hex = `#${rgb.map((x) => Math.round(255 * srgb(x)).toString(16).padStart(2, "0")).join("")}`;
        return element(
          "div",
          { class: "patch" },
          element("i", { style: `background:${css}`, role: "img", "aria-label": `colour ${hex}` }),
          element("span", {}, element("b", {}, material.title), element("br"), `albedo ${albedo.reflected.length <= 4 ? albedo.reflected.map((x) => written(x, 3)).join(" ") : written(material.scalar(albedo.reflected, -1), 3)}, sRGB ${hex}`),
        );
      }),
    );
  }

  async bring() {
    const { theta, phi, spectrum } = this.app.state;
    const wi = direction(theta, phi);
    const wo = { mirror: mirror(wi), normal: [0, 0, 1], light: wi }[spectrum] ?? [0, 0, 1];
    for (const material of this.app.materials.filter((one) => one.glsl)) {
      const key = JSON.stringify([wi, wo, [...material.values]]);
      if (material.spectrumKey === key) continue;
      material.spectrumKey = key;
      const grid = gridOf([wi], [wo], 1, 1);
      const values = (await evaluate(this.app.gpu, material, grid)).at(0, 0);
      grid.dispose();
      if (material.spectrumKey !== key) continue;
      this.values.set(material, values);
      this.changed("curves");
    }
  }

  picture() {
    return framed(this.chart.canvas);
  }

  csv() {
    const lines = ["# f [1/sr] by channel at one pair of directions", "material,channel,f"];
    for (const material of this.app.materials) (this.values.get(material) ?? []).forEach((value, k) => lines.push(`"${material.title.replaceAll('"', '""')}",${material.components === 1 ? "f" : material.channelName(k)},${value}`));
    return `${lines.join("\n")}\n`;
  }
}

const srgb = (x) => {
  const y = Math.min(1, Math.max(0, x));
  return y <= 0.0031308 ? 12.92 * y : 1.055 * y ** (1 / 2.4) - 0.055;
};

/** Places of channels: wavelengths where the names are numbers, else 0, 1, 2 ... */
function axisOf(material) {
  const names = Array.from({ length: material.components }, (_, k) => (material.components === 1 ? "f" : material.channelName(k)));
  const waves = names.map((name) => Number.parseFloat(name));
  if (names.length > 1 && waves.every((x, k) => x > 100 && (k === 0 || x > waves[k - 1]))) return { x: waves, waves: true, names };
  return { x: names.map((_, k) => k), waves: false, names };
}

function bars(drawing, px, py, all) {
  all.forEach(({ colour, y }, m) => {
    drawing.fillStyle = colour;
    drawing.globalAlpha = 0.75;
    y.forEach((value, k) => {
      const [left, right] = [px(k - 0.38 + (0.76 * m) / all.length), px(k - 0.38 + (0.76 * (m + 1)) / all.length)];
      drawing.fillRect(left + 1, py(value), right - left - 2, py(0) - py(value));
    });
    drawing.globalAlpha = 1;
  });
}
