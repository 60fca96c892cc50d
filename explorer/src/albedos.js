import { directionTexture, floats, Pass } from "./gpu.js";
import { DEGREE } from "./directions.js";
import { passOf } from "./passes.js";
import { albedo, DRAWS, MEAN } from "./shaders/albedo.js";

export const THETAS = [...Array.from({ length: 44 }, (_, k) => 2 * k), 87, 88, 89];

/** Albedo against the angle of incidence, by the emitted sampling: {reflected, transmitted}, each [angle][channel]. */
export class Albedos {
  constructor(app) {
    this.app = app;
    this.values = new Map();
    this.stale = new Set();
    this.busy = new Set();
    this.thetas = directionTexture(Float32Array.from(THETAS.flatMap((theta) => [theta * DEGREE, 0, 0, 0])), THETAS.length, 1);
  }

  changed(material) {
    for (const one of material ? [material] : this.app.materials) this.stale.add(one);
  }

  bring(done) {
    for (const material of [...this.stale]) {
      if (this.busy.has(material)) continue;
      if (!material.glsl) {
        this.stale.delete(material);
        continue;
      }
      const pass = passOf(this.app, material, "albedo", () => albedo(material), () => ({ page_phi: { value: 0 }, page_thetas: { value: this.thetas } }));
      this.mean ??= new Pass(this.app.gpu, MEAN, { page_draws: { value: null } }, () => this.app.redraw());
      if (!this.mean.ready() | !pass) continue;
      this.stale.delete(material);
      this.busy.add(material);
      this.of(material, pass)
        .then((values) => this.values.set(material, values), (error) => this.app.errors.show(error))
        .finally(() => {
          this.busy.delete(material);
          done();
        });
    }
    return this.stale.size > 0;
  }

  async of(material, pass) {
    const sides = material.twoSided ? 2 : 1;
    const height = sides * Math.ceil(material.components / 4);
    const width = THETAS.length;
    pass.target ??= floats(width, height * DRAWS);
    pass.means ??= floats(width, height);
    pass.uniforms.page_phi.value = this.app.state.phi * DEGREE;
    pass.draw(pass.target);
    this.mean.uniforms.page_draws.value = pass.target.texture;
    this.mean.draw(pass.means);
    const data = await this.app.gpu.read(pass.means, width, height);
    const side = (s) => THETAS.map((_, x) => Array.from({ length: material.components }, (__, c) => (s < sides ? data[4 * ((sides * (c >> 2) + s) * width + x) + (c & 3)] : 0)));
    return { reflected: side(0), transmitted: side(1) };
  }

  at(material, theta) {
    const values = this.values.get(material);
    if (!values) return null;
    const high = Math.max(1, THETAS.findIndex((one) => one >= theta));
    const share = Math.min(1, Math.max(0, (theta - THETAS[high - 1]) / (THETAS[high] - THETAS[high - 1])));
    const mix = (rows) => rows[high].map((value, c) => rows[high - 1][c] + share * (value - rows[high - 1][c]));
    return { reflected: mix(values.reflected), transmitted: mix(values.transmitted) };
  }
}
