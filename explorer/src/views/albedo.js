import { CartesianChart } from "../chart.js";
import { angleText, ticks, written } from "../numbers.js";
import { THETAS } from "../albedos.js";
import { View } from "./view.js";
import { framed } from "./plots.js";

/** What draws from the albedos: brings them, and asks for one more frame while a program is being compiled. */
class AlbedoView extends View {
  constructor(app, label) {
    super(app);
    this.chart = new CartesianChart(label, this.constructor.key);
    this.body.append(this.chart.canvas, this.chart.readout);
  }

  changed(kind, material) {
    if (["materials", "values", "incidence"].includes(kind)) this.app.albedos.changed(material);
    super.changed();
  }

  draw() {
    const waiting = this.app.albedos.bring(() => this.app.albedoViews().forEach((view) => view.changed("curves")));
    const { units } = this.app.state;
    const curves = this.curvesOf();
    this.chart.set({
      curves, from: 0, to: 90, scale: "linear",
      top: Math.max(1, ...curves.flatMap(({ y }) => [...y])) * 1.02,
      marks: units === "radians" ? ticks(0, 1.5, 6).map((x) => [(x * 180) / Math.PI, written(x, 3)]) : ticks(0, 90, 9).map((x) => [x, `${x}°`]),
      label: `angle of incidence θᵢ${units === "radians" ? " [rad]" : ""}`,
      format: (x) => `θᵢ = ${angleText(x, units)}`,
      hint: "Estimated from 1024 directions by the emitted sampling. Point, or press ← →, to read.",
      ...this.look(),
    });
    return waiting;
  }

  picture() {
    return framed(this.chart.canvas);
  }

  csv() {
    const lines = ["# albedo against the angle of incidence [degrees], estimated from 1024 directions", "material,theta_i,channel,reflected,transmitted"];
    for (const [material, { reflected, transmitted }] of this.app.albedos.values) {
      if (!this.app.materials.includes(material)) continue;
      const title = `"${material.title.replaceAll('"', '""')}"`;
      THETAS.forEach((theta, k) => reflected[k].forEach((value, c) => lines.push([title, theta, material.components === 1 ? "f" : material.channelName(c), value, transmitted[k][c]].join(","))));
    }
    return `${lines.join("\n")}\n`;
  }
}

const RGB = ["#d33a2c", "#2f9e44", "#2f6fd6"];

export class Albedo extends AlbedoView {
  static key = "albedo";
  static title = "Albedo";

  constructor(app) {
    super(app, "Albedo against the angle of incidence");
  }

  curvesOf() {
    const { app } = this;
    const { channel } = app.state;
    const single = app.materials.length === 1;
    return app.materials.flatMap((material) => {
      const values = app.albedos.values.get(material);
      if (!values) return [];
      const curve = (rows, name, dash) => ({ x: THETAS, y: rows.map((row) => material.scalar(row, channel)), colour: material.colour, name: `${single ? "" : `${material.title.slice(0, 28)}, `}${name}`, dash });
      const all = single && channel < 0 && material.components === 3
        ? RGB.map((colour, c) => ({ x: THETAS, y: values.reflected.map((row) => row[c]), colour, name: material.channelName(c), width: 1.2 }))
        : [];
      return [...all, curve(values.reflected, material.twoSided ? "reflected" : "albedo"), ...(material.twoSided ? [curve(values.transmitted, "transmitted", [6, 4])] : [])];
    });
  }

  look() {
    return { ordinateLabel: "albedo" };
  }
}

/** Where the light goes: reflected, transmitted and absorbed shares above each other, of materials that let light through. */
export class Transmission extends AlbedoView {
  static key = "transmission";
  static title = "Transmission";
  static needs = (material) => material.twoSided && material.glsl;

  constructor(app) {
    super(app, "Reflected and transmitted share against the angle of incidence");
  }

  curvesOf() {
    const { app } = this;
    return app.materials.filter(Transmission.needs).flatMap((material) => {
      const values = app.albedos.values.get(material);
      if (!values) return [];
      const of = (rows) => rows.map((row) => material.scalar(row, app.state.channel));
      const [reflected, transmitted] = [of(values.reflected), of(values.transmitted)];
      const name = app.materials.length > 1 ? `${material.title.slice(0, 24)}, ` : "";
      return [
        { x: THETAS, y: reflected, colour: material.colour, name: `${name}reflected` },
        { x: THETAS, y: transmitted, colour: material.colour, name: `${name}transmitted`, dash: [6, 4] },
        { x: THETAS, y: reflected.map((value, k) => value + transmitted[k]), colour: material.colour, name: `${name}both`, faint: 0.5, width: 1 },
      ];
    });
  }

  look() {
    const first = this.curvesOf();
    return {
      ordinateLabel: "share of the light",
      fill: first.length
        ? (drawing, px, py) => {
            const [reflected, , both] = first;
            band(drawing, px, py, reflected.x, reflected.x.map(() => 0), reflected.y, reflected.colour, 0.3);
            band(drawing, px, py, reflected.x, reflected.y, both.y, reflected.colour, 0.14);
          }
        : null,
    };
  }
}

function band(drawing, px, py, x, low, high, colour, alpha) {
  drawing.globalAlpha = alpha;
  drawing.fillStyle = colour;
  drawing.beginPath();
  x.forEach((at, k) => drawing.lineTo(px(at), py(high[k])));
  for (let k = x.length - 1; k >= 0; k--) drawing.lineTo(px(x[k]), py(low[k]));
  drawing.fill();
  drawing.globalAlpha = 1;
}
