import { element, labelled, select } from "../dom.js";
import { CartesianChart, PolarChart } from "../chart.js";
import { angleText, debounced, mark } from "../numbers.js";
import { View } from "./view.js";

const DASHES = [[], [7, 3], [2, 2], [9, 3, 2, 3], [4, 4], [12, 4]];

/** What both plots of the plane share: scale, further angles, the curves as CSV. */
class PlaneView extends View {
  constructor(app, chart) {
    super(app);
    this.chart = chart;
    this.body.append(chart.canvas, chart.readout);
    const { plane } = app.state;
    const told = () => app.change("plane");
    const further = element("input", {
      type: "text", size: 9, placeholder: "15 30 60", "aria-label": "further angles of incidence in degrees", value: plane.angles.join(" "),
      title: "Further angles of incidence, in degrees",
    });
    further.addEventListener("input", debounced(250, () => {
      plane.angles = further.value.split(/[\s,;]+/).filter(Boolean).map(Number).filter((x) => x >= 0 && x < 90);
      told();
    }));
    const across = element("input", { type: "checkbox" });
    across.checked = plane.across;
    across.addEventListener("change", () => { plane.across = across.checked; told(); });
    this.bar.append(
      labelled("f", select([["linear", "linear"], ["log", "log"]], plane.scale, (value) => { plane.scale = value; told(); }, { "data-testid": `${this.constructor.key}-scale` })),
      labelled("also θᵢ", further),
      labelled("across", across),
    );
    this.synchronize = () => {
      this.bar.querySelector("select").value = plane.scale;
      across.checked = plane.across;
      if (document.activeElement !== further) further.value = plane.angles.join(" ");
    };
  }

  changed(kind, material) {
    if (["materials", "values", "incidence", "channel", "plane"].includes(kind)) this.app.plane.changed(material);
    if (kind === "plane") this.synchronize();
    super.changed();
  }

  draw() {
    this.app.plane.bring(() => this.app.planeViews().forEach((view) => view.changed("curves")));
    const { units, plane, theta } = this.app.state;
    const thetas = [...new Set([theta, ...plane.angles])];
    const several = this.app.materials.length > 1;
    this.curves = this.app.plane.all().filter((curve) => plane.across || !curve.across);
    const curves = this.curves.map((curve) => ({
      ...curve,
      colour: curve.material.colour,
      dash: DASHES[Math.max(0, thetas.indexOf(curve.theta)) % DASHES.length],
      faint: curve.across ? 0.5 : 1,
      width: curve.across ? 1.25 : 1.9,
      name: [several ? curve.material.title.slice(0, 28) : null, thetas.length > 1 ? `θᵢ ${angleText(curve.theta, units, 3)}` : null, curve.across ? "across" : "in plane"].filter(Boolean).join(", "),
    }));
    const whole = this.app.materials.some((one) => one.twoSided);
    const end = whole ? 180 : 90;
    const radians = units === "radians";
    const marks = Array.from({ length: 7 }, (_, k) => ((k - 3) * end) / 3).map((x) => [x, mark(x, units)]);
    this.chart.set({
      curves, whole, scale: plane.scale, from: -end, to: end, marks,
      mark: (angle) => mark(angle, units),
      counts: (angle) => Math.abs(Math.abs(angle) - 90) > 2, // there tables divide by small cosines
      arrows: thetas.slice(0, 1).map((at) => ({ angle: -at, colour: this.app.theme.accent() })),
      label: `θₒ${radians ? " [rad]" : ""}: on the side of the light − … + on the side of the mirror direction`,
      ordinateLabel: "f [sr⁻¹]",
      format: (x) => `θₒ = ${angleText(x, units)}`,
      hint: "Point, or press ← →, to read f.",
    });
    return false;
  }

  csv() {
    const channels = (material) => Array.from({ length: material.components }, (_, k) => (material.components === 1 ? "f" : material.channelName(k)));
    const lines = ["# f [1/sr] in the plane of incidence and across it; angles in degrees", "# theta_o is positive on the side of the mirror direction", "material,theta_i,phi_i,plane,theta_o,channel,f"];
    for (const { material, theta, across, x, all } of this.curves ?? []) {
      const names = channels(material);
      const title = `"${material.title.replaceAll('"', '""')}"`;
      x.forEach((angle, k) => names.forEach((name, c) => lines.push([title, theta, this.app.state.phi, across ? "across" : "incidence", angle, name, all[k][c]].join(","))));
    }
    return `${lines.join("\n")}\n`;
  }

  picture() {
    return framed(this.chart.canvas);
  }
}

export class Polar extends PlaneView {
  static key = "polar";
  static title = "Polar plot";

  constructor(app) {
    super(app, new PolarChart("f in the plane of incidence, as a polar plot", "polar"));
  }
}

export class Cartesian extends PlaneView {
  static key = "cartesian";
  static title = "Cartesian plot";

  constructor(app) {
    super(app, new CartesianChart("f in the plane of incidence against the outgoing angle", "cartesian"));
  }
}

export function framed(canvas) {
  const made = element("canvas", { width: canvas.width, height: canvas.height });
  const drawing = made.getContext("2d");
  drawing.fillStyle = getComputedStyle(document.documentElement).getPropertyValue("--panel");
  drawing.fillRect(0, 0, made.width, made.height);
  drawing.drawImage(canvas, 0, 0);
  return made;
}
