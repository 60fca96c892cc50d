import { element } from "../dom.js";
import { evaluate, gridOf } from "../evaluate.js";
import { fromHalf } from "../directions.js";
import { angleText, mark, written } from "../numbers.js";
import { passOf } from "../passes.js";
import { SLICE } from "../shaders/slice.js";
import { rangeControl } from "../ui/range.js";
import { CellView } from "./view.js";

/** f as an image over the angles of the half vector, at phi_d = 90 degrees. */
export class Slice extends CellView {
  static key = "slice";
  static title = "θₕ–θ_d slice";
  static testid = "slice";

  constructor(app) {
    super(app);
    const { slice } = app.state;
    const control = (label, key, low, high, unit) =>
      rangeControl({ label, unit, low, high, step: 0.1, value: slice[key], change: (value) => { slice[key] = value; app.change("view", null, this); } });
    this.bar.append(control("exposure", "exposure", -10, 10, "EV"), control("gamma", "gamma", 1, 4, ""));
  }

  changed(kind, material) {
    if (kind === "incidence" || kind === "channel") return;
    super.changed(kind, material);
  }

  prepare(cell) {
    const box = cell.canvas.parentElement;
    box.classList.add("axes");
    cell.x = element("div", { class: "x" });
    cell.y = element("div", { class: "y" });
    box.append(cell.x, cell.y);
    cell.cursor = null;
    cell.canvas.addEventListener("pointermove", (event) => {
      const around = cell.canvas.getBoundingClientRect();
      this.point(cell, [(90 * (event.clientX - around.left)) / around.width, 90 * (1 - (event.clientY - around.top) / around.height)]);
    });
    cell.canvas.addEventListener("keydown", (event) => {
      const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
      if (!way) return;
      event.preventDefault();
      const [h, d] = cell.cursor ?? [0, 0];
      this.point(cell, [h + way[0], d + way[1]]);
    });
  }

  async point(cell, angles) {
    cell.cursor = angles.map((angle) => Math.min(89.9, Math.max(0, angle)));
    if (cell.asking) return;
    cell.asking = true;
    const [thetaH, thetaD] = cell.cursor;
    const [wi, wo] = fromHalf(thetaH, thetaD, 90);
    const grid = gridOf([wi], [wo], 1, 1);
    const value = cell.material.scalar((await evaluate(this.app.gpu, cell.material, grid)).at(0, 0), this.app.state.channel);
    grid.dispose();
    cell.asking = false;
    const { units } = this.app.state;
    const below = wi[2] <= 0 || wo[2] <= 0;
    cell.note.textContent = `θₕ ${angleText(thetaH, units, 3)}, θ_d ${angleText(thetaD, units, 3)}: ${below ? "below the horizon" : `f = ${written(value, 5)} sr⁻¹`}`;
    if (cell.cursor[0] !== thetaH || cell.cursor[1] !== thetaD) this.point(cell, cell.cursor);
  }

  /** Angles along two sides of the picture. */
  mark(cell) {
    const { units } = this.app.state;
    const size = Number.parseFloat(cell.canvas.style.width);
    const marks = (size > 150 ? [0, 30, 60, 90] : [0, 90]).map((angle) => element("span", {}, mark(angle, units)));
    cell.x.replaceChildren(...marks, element("em", {}, "θₕ"));
    cell.y.replaceChildren(...marks.map((one) => one.cloneNode(true)).reverse(), element("em", {}, "θ_d"));
    cell.x.style.width = cell.y.style.height = `${size}px`;
    cell.canvas.parentElement.style.setProperty("--half", `${size / 2}px`);
  }

  drawCell(cell) {
    if (!this.fit(cell, true)) return false;
    const { material, canvas } = cell;
    const pass = passOf(this.app, material, "slice", () => SLICE, () => ({
      page_size: { value: [1, 1] }, page_phi_d: { value: Math.PI / 2 }, page_gain: { value: 1 }, page_gamma: { value: 2.2 },
    }));
    if (!pass) return true;
    const { slice } = this.app.state;
    pass.uniforms.page_size.value = [canvas.width, canvas.height];
    pass.uniforms.page_gain.value = 2 ** slice.exposure;
    pass.uniforms.page_gamma.value = slice.gamma;
    pass.draw(null, canvas.width, canvas.height);
    this.app.gpu.show(canvas);
    this.mark(cell);
    return false;
  }
}
