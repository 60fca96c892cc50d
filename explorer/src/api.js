import { evaluate, gridOf } from "./evaluate.js";

/** What scripts may rely on: `window.gonio`. `page` returns the page once it is built; `ready` is fulfilled when it is drawn. */
export function publish(page, ready) {
  window.gonio = {
    ready,
    get materials() {
      return page()?.materials ?? [];
    },
    get state() {
      return page()?.state;
    },
    get frames() {
      return page()?.frames ?? 0;
    },
    get lastUpdate() {
      return page()?.lastUpdate;
    },
    /** Fulfilled when everything in sight is drawn. */
    idle: () => page().idle(),
    add: (text) => page().add(text),
    setParameter: (index, path, value) => page().setParameter(index, path, value),
    setIncidence: (theta, phi) => page().setIncidence(theta, phi),
    /** f of material `index` at pairs of directions, as this page's GPU computes it: an array of channels for each pair. */
    async evaluate(index, wi, wo) {
      const app = page();
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
