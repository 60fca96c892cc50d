import { evaluate, gridOf } from "./evaluate.js";
import { direction, inPlane, planeAngles } from "./directions.js";

/**
 * f in the plane of incidence and across it, for the incidence of the page and the further angles asked for:
 * what the polar and the Cartesian plot draw. Of the states that come while one is evaluated the newest is next.
 */
export class Plane {
  constructor(app) {
    this.app = app;
    this.curves = new Map(); // material -> curves
    this.stale = new Set();
    this.busy = new Set();
  }

  changed(material) {
    for (const one of material ? [material] : this.app.materials) this.stale.add(one);
  }

  /** Starts what is stale; `done` is called when new curves are there. */
  bring(done) {
    for (const material of [...this.stale]) {
      if (this.busy.has(material)) continue;
      this.stale.delete(material);
      if (!material.glsl) continue;
      this.busy.add(material);
      this.curvesOf(material)
        .then((curves) => this.curves.set(material, curves), (error) => this.app.errors.show(error))
        .finally(() => {
          this.busy.delete(material);
          done();
        });
    }
  }

  all() {
    return this.app.materials.flatMap((material) => this.curves.get(material) ?? []);
  }

  async curvesOf(material) {
    const { theta, phi, plane, channel } = this.app.state;
    const thetas = [...new Set([theta, ...plane.angles])];
    const grid = this.grid(thetas, phi, material.twoSided);
    const values = await evaluate(this.app.gpu, material, grid);
    return grid.rows.map(({ theta: at, across, angles }, row) => {
      const all = angles.map((_, k) => values.at(k, row));
      return { material, theta: at, across, x: angles, all, y: all.map((one) => material.scalar(one, channel)) };
    });
  }

  grid(thetas, phi, whole) {
    const key = JSON.stringify([thetas, phi, whole]);
    this.grids ??= new Map();
    if (this.grids.get(whole)?.key === key) return this.grids.get(whole);
    const rows = thetas.flatMap((theta) => {
      const peaks = whole ? [theta, 0, theta - 180] : [theta, 0];
      return [
        { theta, across: false, angles: planeAngles(whole, peaks), azimuth: phi + 180 },
        { theta, across: true, angles: planeAngles(whole, whole ? [0, 180] : [0]), azimuth: phi + 90 },
      ];
    });
    const width = Math.max(...rows.map(({ angles }) => angles.length));
    const padded = (row) => Array.from({ length: width }, (_, k) => row.angles[Math.min(k, row.angles.length - 1)]);
    const wi = rows.flatMap((row) => Array(width).fill(direction(row.theta, phi)));
    const wo = rows.flatMap((row) => padded(row).map((angle) => inPlane(angle, row.azimuth)));
    this.grids.get(whole)?.dispose();
    const grid = { ...gridOf(wi, wo, width, rows.length), rows, key };
    this.grids.set(whole, grid);
    return grid;
  }
}
