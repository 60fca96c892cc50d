/** The emitted source of a material, with its arguments as uniforms, behind names that every view uses. */
export function materialGlsl(material) {
  const { glsl, components } = material;
  const { name, type } = glsl;
  const uniforms = glsl.arguments.map((one) => `uniform ${declared(one)};`);
  const given = glsl.arguments.map((one) => `, page_p_${one.name}`).join("");
  const result = type.startsWith("float[") ? `float[${components}]` : type;
  const at = (k) => (components === 1 ? "v" : `v[${k}]`);
  const parts = [
    glsl.text,
    ...uniforms,
    `uniform vec3 page_rgb[${components}];`,
    "uniform int page_channel;",
    `vec3 page_colour(${result} v) {`,
    `  return ${Array.from({ length: components }, (_, k) => `${at(k)} * page_rgb[${k}]`).join(" + ")};`,
    "}",
    `float page_component(${result} v, int k) { return k < ${components} ? ${components === 1 ? "v" : `v[min(k, ${components - 1})]`} : 0.0; }`,
    `vec4 page_four(${result} v, int k) {`,
    "  return vec4(page_component(v, k), page_component(v, k + 1), page_component(v, k + 2), page_component(v, k + 3));",
    "}",
    `float page_scalar(${result} v) {`,
    components === 1
      ? "  return v;"
      : `  return page_channel < 0 ? dot(page_colour(v), vec3(0.2126, 0.7152, 0.0722)) : page_component(v, min(page_channel, ${components - 1}));`,
    "}",
    "bool page_hole(float x) { return !(x >= 0.0 || x < 0.0); }",
    `${result} page_f(vec3 wi, vec3 wo) { return ${name}_f(wi, wo${given}); }`,
    "vec3 page_f_rgb(vec3 wi, vec3 wo) { return page_colour(page_f(wi, wo)); }",
  ];
  if (material.has("sample") && material.has("pdf")) {
    parts.push(
      `float page_pdf(vec3 wi, vec3 wo) { return ${name}_pdf(wi, wo${given}); }`,
      `void page_sample_all(vec3 wo, vec2 u, out vec3 wi, out ${result} weight, out float pdf, out bool delta) {`,
      `  ${name}_sample(wo, u${given}, wi, weight, pdf, delta);`,
      "}",
    );
  } else {
    parts.push(cosineSampling(material, result));
  }
  if (material.has("mueller")) {
    parts.push(
      `float page_mueller(vec3 wi, vec3 wo, int element) {`,
      `  return ${name}_mueller(wi, wo${given})[16 * clamp(page_channel, 0, ${components - 1}) + element];`,
      "}",
    );
  }
  return `${parts.join("\n")}\n`;
}

/** Directions by the cosine, on both sides where light comes through. */
function cosineSampling(material, result) {
  const sides = material.twoSided ? "0.5" : "1.0";
  const below = material.twoSided ? "wi.z > 0.0 || wi.z < 0.0" : "wi.z > 0.0";
  const scaled = material.components <= 4
    ? "weight = page_f(wi, wo) * (abs(wi.z) / pdf);"
    : `weight = page_f(wi, wo); for (int k = 0; k < ${material.components}; k++) weight[k] *= abs(wi.z) / pdf;`;
  return `
float page_pdf(vec3 wi, vec3 wo) { return ${below} ? ${sides} * abs(wi.z) / 3.14159265 : 0.0; }
void page_sample_all(vec3 wo, vec2 u, out vec3 wi, out ${result} weight, out float pdf, out bool delta) {
  float side = 1.0;
  ${material.twoSided ? "if (u.x < 0.5) { u.x *= 2.0; } else { u.x = 2.0 * u.x - 1.0; side = -1.0; }" : ""}
  float r = sqrt(u.x);
  wi = vec3(r * cos(6.2831853 * u.y), r * sin(6.2831853 * u.y), side * sqrt(max(1e-6, 1.0 - u.x)));
  pdf = page_pdf(wi, wo);
  delta = false;
  ${scaled}
}`;
}

function declared({ name, width }) {
  if (width === 1) return `float page_p_${name}`;
  return width <= 4 ? `vec${width} page_p_${name}` : `float page_p_${name}[${width}]`;
}
