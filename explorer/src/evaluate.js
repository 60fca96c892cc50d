import { directionTexture, floats, Pass } from "./gpu.js";
import { EVALUATE } from "./shaders/evaluate.js";

/** f of all channels at width x height directions: {data, at(x, y)} with `at` an array of channels. */
export async function evaluate(gpu, material, grid) {
  const pass = await evaluator(gpu, material);
  const { width, height } = grid;
  const blocks = Math.ceil(material.components / 4);
  const target = sized(pass, width, height * blocks);
  pass.uniforms.page_wi.value = grid.wi;
  pass.uniforms.page_wo.value = grid.wo;
  pass.uniforms.page_height.value = height;
  pass.draw(target);
  const data = await gpu.read(target, width, height * blocks);
  const at = (x, y) => Array.from({ length: material.components }, (_, c) => data[4 * (((c >> 2) * height + y) * width + x) + (c & 3)]);
  return { data, at };
}

function evaluator(gpu, material) {
  let pass = material.passes.get("evaluate");
  if (!pass) {
    const uniforms = { ...material.uniforms, page_wi: { value: null }, page_wo: { value: null }, page_height: { value: 1 } };
    pass = new Pass(gpu, material.glslText + EVALUATE, uniforms, () => pass.done());
    pass.whenReady = new Promise((resolve) => (pass.done = resolve));
    material.passes.set("evaluate", pass);
    pass.ready();
  }
  return pass.whenReady.then(() => pass.ready() && pass);
}

function sized(pass, width, height) {
  if (pass.target && (pass.target.width !== width || pass.target.height !== height)) {
    pass.target.dispose();
    pass.target = null;
  }
  pass.target ??= floats(width, height);
  return pass.target;
}

/** Directions as two textures: `wi` and `wo` are arrays of [x, y, z], row after row. */
export function gridOf(wi, wo, width, height) {
  const packed = (list) => {
    const data = new Float32Array(4 * width * height);
    list.forEach(([x, y, z], k) => data.set([x, y, z, 0], 4 * k));
    return directionTexture(data, width, height);
  };
  const grid = { width, height, wi: packed(wi), wo: packed(wo) };
  grid.dispose = () => [grid.wi, grid.wo].forEach((texture) => texture.dispose());
  return grid;
}
