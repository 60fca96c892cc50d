/**
 * The lobe's mesh as a texture of directions with f: patches of rows, each a polar grid around an axis of its own, dense
 * towards it. Rows from `first` on: above the horizon around the mirror direction, caps around wi and the normal,
 * and, where light comes through, below the horizon around the straight way.
 */
export const COLUMNS = 97;
export const PATCHES = [
  { first: 0, rows: 68, reach: 180, power: 1.9, axis: 0, side: 1 },
  { first: 68, rows: 14, reach: 14, power: 1.3, axis: 1, side: 1 },
  { first: 82, rows: 14, reach: 14, power: 1.3, axis: 2, side: 1 },
  { first: 96, rows: 68, reach: 180, power: 1.9, axis: 3, side: -1 },
];

export function lobeRows(twoSided) {
  return twoSided ? 164 : 96;
}

const number = (x) => x.toFixed(6);

const patches = PATCHES.map(
  ({ first, rows, reach, power, axis, side }) =>
    `  if (row >= ${first}) { s = float(row - ${first}) / ${number(rows - 1)}; reach = ${number((reach * Math.PI) / 180)}; power = ${number(power)}; axis = axes[${axis}]; side = ${number(side)}; }`,
).join("\n");

export const FIELD = `
uniform vec3 page_incident;
out vec4 page_out;
void main() {
  vec3 wi = page_incident;
  vec3 axes[4] = vec3[4](vec3(-wi.xy, wi.z), wi, vec3(0.0, 0.0, 1.0), -wi);
  int row = int(gl_FragCoord.y);
  float s, reach, power, side;
  vec3 axis;
${patches}
  float psi = reach * pow(s, power);
  float angle = 6.28318531 * floor(gl_FragCoord.x) / ${number(COLUMNS - 1)};
  vec3 x = abs(axis.z) > 0.999999 ? vec3(1.0, 0.0, 0.0) : normalize(vec3(-axis.y, axis.x, 0.0));
  vec3 y = cross(axis, x);
  vec3 wo = cos(psi) * axis + sin(psi) * (cos(angle) * x + sin(angle) * y);
  float least = 1e-3;
  if (wo.z * side < least) {
    float flat_ = length(wo.xy);
    wo = normalize(vec3(flat_ > 1e-6 ? wo.xy / flat_ : vec2(1.0, 0.0), side * least));
  }
  float f = page_scalar(page_f(wi, wo));
  page_out = vec4(wo, page_hole(f) ? 0.0 : max(f, 0.0));
}`;

/** The largest f of each column, then of all columns; beyond 88 degrees, where tables divide by small cosines, none counts. */
export const COLUMN_MAXIMUM = `
uniform sampler2D page_field;
out vec4 page_out;
void main() {
  float largest = 0.0;
  int rows = textureSize(page_field, 0).y;
  for (int row = 0; row < rows; row++) {
    vec4 texel = texelFetch(page_field, ivec2(int(gl_FragCoord.x), row), 0);
    if (abs(texel.z) > 0.035) largest = max(largest, texel.w);
  }
  page_out = vec4(largest);
}`;

export const MAXIMUM = `
uniform sampler2D page_columns;
out vec4 page_out;
void main() {
  float largest = 0.0;
  for (int k = 0; k < ${COLUMNS}; k++) largest = max(largest, texelFetch(page_columns, ivec2(k, 0), 0).x);
  page_out = vec4(largest);
}`;

const bounds = PATCHES.map(({ first, rows }) => `  if (row >= ${first}) { first = ${first}; last = ${first + rows - 1}; }`).join("\n");

/** Places and normals of the mesh: f as a radius, over the largest f of the materials from `page_from` on. */
export const SHAPE = `
uniform sampler2D page_field;
uniform sampler2D page_maxima;
uniform int page_from;
uniform int page_to;
uniform int page_radius;
layout(location = 0) out vec4 page_place;
layout(location = 1) out vec4 page_normal;
float page_largest;
float radius(float f) {
  float x = min(f / page_largest, 1.25);
  if (page_radius == 1) return max(0.0, 1.0 + log(max(x, 1e-20)) / log(1e4));
  if (page_radius == 2) return pow(x, 1.0 / 3.0);
  return x;
}
vec3 at(int column, int row) {
  vec4 texel = texelFetch(page_field, ivec2(column, row), 0);
  return texel.xyz * radius(texel.w);
}
void main() {
  page_largest = 1e-30;
  for (int k = page_from; k < page_to; k++) page_largest = max(page_largest, texelFetch(page_maxima, ivec2(k, 0), 0).x);
  int column = int(gl_FragCoord.x);
  int row = int(gl_FragCoord.y);
  int first = 0, last = 0;
${bounds}
  vec4 texel = texelFetch(page_field, ivec2(column, row), 0);
  vec3 here = texel.xyz * radius(texel.w);
  vec3 across = at(column == ${COLUMNS - 1} ? 1 : column + 1, row) - at(column == 0 ? ${COLUMNS - 2} : column - 1, row);
  vec3 along = at(column, min(row + 1, last)) - at(column, max(row - 1, first));
  vec3 normal = cross(along, across);
  float size = length(normal);
  normal = row > first && size > 1e-12 ? normal / size : texel.xyz;
  page_place = vec4(here, 0.0);
  page_normal = vec4(dot(normal, texel.xyz) < 0.0 ? -normal : normal, 0.0);
}`;

export const LOBE_VERTEX = `
uniform sampler2D page_field;
uniform sampler2D page_places;
uniform sampler2D page_normals;
uniform mat4 projectionMatrix;
uniform mat4 modelViewMatrix;
in vec3 position; // column, row, nothing
out vec3 page_normal;
out vec3 page_view;
out vec3 page_wo;
out float page_r;
void main() {
  ivec2 from = ivec2(position.xy);
  vec3 here = texelFetch(page_places, from, 0).xyz;
  page_wo = texelFetch(page_field, from, 0).xyz;
  page_normal = mat3(modelViewMatrix) * texelFetch(page_normals, from, 0).xyz;
  page_r = length(here);
  vec4 view = modelViewMatrix * vec4(here, 1.0);
  page_view = view.xyz;
  gl_Position = projectionMatrix * view;
}`;

export const LOBE_FRAGMENT = `
uniform vec3 page_tint;
uniform float page_alpha;
uniform vec3 page_ink;
in vec3 page_normal;
in vec3 page_view;
in vec3 page_wo;
in float page_r;
out vec4 page_out;
float graticule(float angle, float step) {
  float x = angle / step;
  float width = fwidth(x);
  float near_ = abs(fract(x - 0.5) - 0.5) / max(width, 1e-6);
  return (1.0 - smoothstep(0.0, 1.2, near_)) * (1.0 - smoothstep(0.25, 0.5, width));
}
void main() {
  vec3 n = normalize(page_normal);
  vec3 v = normalize(-page_view);
  if (dot(n, v) < 0.0) n = -n;
  vec3 key = normalize(vec3(-0.45, 0.75, 0.6));
  float light = 0.38 + 0.5 * max(dot(n, key), 0.0) + 0.16 * max(dot(n, v), 0.0);
  float shine = 0.22 * pow(max(dot(n, normalize(key + v)), 0.0), 40.0);
  vec3 wo = normalize(page_wo);
  float theta = degrees(acos(clamp(wo.z, -1.0, 1.0)));
  float phi = degrees(atan(wo.y, wo.x));
  float lines = graticule(theta, 10.0);
  if (theta > 2.0 && theta < 178.0) lines = max(lines, graticule(phi, 15.0));
  vec3 rgb = page_tint * light + shine;
  rgb = mix(rgb, page_ink, 0.2 * lines * smoothstep(0.02, 0.08, page_r));
  page_out = vec4(rgb * page_alpha, page_alpha);
}`;

export const PLAIN_VERTEX = `
uniform mat4 projectionMatrix;
uniform mat4 modelViewMatrix;
in vec3 position;
void main() { gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }`;

export const PLAIN_FRAGMENT = `
uniform vec4 page_tint;
out vec4 page_out;
void main() { page_out = vec4(page_tint.rgb * page_tint.a, page_tint.a); }`;

export const COPY = `
uniform sampler2D page_picture;
out vec4 page_out;
void main() { page_out = texelFetch(page_picture, ivec2(gl_FragCoord.xy), 0); }`;
