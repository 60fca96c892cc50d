import { Pass } from "./gpu.js";

/** The pass of a material with that name, made when first asked for; null while it is being compiled. */
export function passOf(app, material, name, fragment, uniforms) {
  let pass = material.passes.get(name);
  if (!pass) {
    pass = new Pass(app.gpu, material.glslText + fragment(), { ...material.uniforms, ...uniforms() }, () => app.redraw());
    material.passes.set(name, pass);
  }
  return pass.ready() ? pass : null;
}
