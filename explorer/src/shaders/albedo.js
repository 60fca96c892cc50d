import { RANDOM } from "./random.js";

export const DRAWS = 1024; // directions for each angle of incidence

/**
 * What one drawn direction adds: column = angle of incidence, row = draw; block sides * k + s of the rows holds the channels
 * 4k to 4k + 3 on the side s (0: that of the light).
 */
export function albedo({ glsl, components, twoSided }) {
  const type = glsl.type;
  const scaled = components <= 4
    ? "all = page_f(incident, wo) * (abs(wo.z) / pdf);"
    : `all = page_f(incident, wo); for (int j = 0; j < ${components}; j++) all[j] *= abs(wo.z) / pdf;`;
  return `
uniform float page_phi;
uniform sampler2D page_thetas;
out vec4 page_out;
${RANDOM}
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  int block = at.y / ${DRAWS};
  float theta = texelFetch(page_thetas, ivec2(at.x, 0), 0).x;
  vec3 incident = vec3(sin(theta) * cos(page_phi), sin(theta) * sin(page_phi), cos(theta));
  vec3 wo;
  ${type} all;
  float pdf;
  bool delta;
  page_sample_all(incident, page_point(1u, at.y - block * ${DRAWS}), wo, all, pdf, delta);
  page_out = vec4(0.0);
  if (!(pdf > 0.0 || delta)) return;
  if (!delta) { ${scaled} }
  vec4 four = page_four(all, 4 * (block / ${twoSided ? 2 : 1}));
  if ((wo.z < 0.0) == (block % ${twoSided ? 2 : 1} == 1) && !page_hole(dot(four, vec4(1.0)))) page_out = four;
}`;
}

/** Means of the rows of each block. */
export const MEAN = `
uniform sampler2D page_draws;
out vec4 page_out;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec4 sum = vec4(0.0);
  for (int k = 0; k < ${DRAWS}; k++) sum += texelFetch(page_draws, ivec2(at.x, at.y * ${DRAWS} + k), 0);
  page_out = sum / ${DRAWS}.0;
}`;
