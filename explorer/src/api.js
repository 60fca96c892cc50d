import { evaluate, gridOf } from "./evaluate.js";

/** What scripts may rely on: `window.gonio`. */
export function publish(app) {
  window.gonio = {
    ready: app.start(),
    get materials() {
      return app.materials;
    },
    get state() {
      return app.state;
    },
    get frames() {
      return app.frames;
    },
    get lastUpdate() {
      return app.lastUpdate;
    },
    /** Fulfilled when everything in sight is drawn. */
    idle: () => app.idle(),
    add: (text) => app.add(text),
    setParameter: (index, path, value) => app.setParameter(index, path, value),
    setIncidence: (theta, phi) => app.setIncidence(theta, phi),
    /** f of material `index` at pairs of directions, as this page's GPU computes it: an array of channels for each pair. */
    async evaluate(index, wi, wo) {
      const material = app.materials[index];
      if (!material?.glsl) throw new Error(material?.why ?? `material ${index}: this page shows ${app.materials.length}`);
      const width = Math.min(1024, wi.length);
      const grid = gridOf(wi, wo, width, Math.ceil(wi.length / width));
      const { at } = await evaluate(app.gpu, material, grid);
      grid.dispose();
      return wi.map((_, k) => at(k % width, Math.floor(k / width)));
    },
  };
}
