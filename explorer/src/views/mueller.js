import { element, labelled, select } from "../dom.js";
import { direction } from "../directions.js";
import { angleText } from "../numbers.js";
import { passOf } from "../passes.js";
import { MUELLER } from "../shaders/mueller.js";
import { CellView } from "./view.js";

/** The sixteen elements of the Mueller matrix over the outgoing hemisphere. */
export class Mueller extends CellView {
  static key = "mueller";
  static title = "Mueller matrix";
  static testid = "mueller";
  static needs = (material) => material.has("mueller");

  constructor(app) {
    super(app);
    this.bar.append(labelled("elements", select([["relative", "over m₀₀, −1 … 1"], ["absolute", "as they are [sr⁻¹]"]], app.state.mueller, (value) => { app.state.mueller = value; app.change("view", null, this); })));
  }

  shownMaterials() {
    return this.app.materials.filter(Mueller.needs);
  }

  prepare(cell) {
    const box = cell.canvas.parentElement;
    box.append(element("div", { class: "elements", "aria-hidden": "true" }, Array.from({ length: 16 }, (_, k) => element("span", {}, `m${"₀₁₂₃"[k >> 2]}${"₀₁₂₃"[k & 3]}`))));
    box.append(element("div", { class: "scale", "aria-hidden": "true" }, ["≥ 1", "0", "≤ −1"].map((one) => element("span", {}, one))));
  }

  drawCell(cell) {
    if (!this.fit(cell, true)) return false;
    const { material, canvas } = cell;
    const pass = passOf(this.app, material, "mueller", () => MUELLER, () => ({
      page_size: { value: [1, 1] }, page_incident: { value: [0, 0, 1] }, page_relative: { value: 1 },
    }));
    if (!pass) return true;
    const { theta, phi, mueller, units } = this.app.state;
    pass.uniforms.page_size.value = [canvas.width, canvas.height];
    pass.uniforms.page_incident.value = direction(theta, phi);
    pass.uniforms.page_relative.value = mueller === "relative" ? 1 : 0;
    pass.draw(null, canvas.width, canvas.height);
    this.app.gpu.show(canvas);
    cell.note.textContent = `θᵢ ${angleText(theta, units, 3)}; seen from above, rim: θₒ = ${angleText(90, units, 3)}`;
    return false;
  }
}
