import { RANDOM } from "./random.js";

/** Shapes seen by a camera: where each pixel's ray meets the sphere, or what a mesh left in two textures. */
const SEEN = `
uniform vec2 page_size;
uniform vec2 page_jitter;
uniform vec3 page_eye;
uniform mat3 page_look; // right, up, back
uniform float page_zoom;`;

const SPHERE = `
bool page_surface(out vec3 place, out vec3 normal) {
  vec2 at = (gl_FragCoord.xy + page_jitter - 0.5 * page_size) * (2.0 * page_zoom / min(page_size.x, page_size.y));
  float far = dot(page_eye, page_eye);
  float squared = 1.0 + dot(at, at);
  float inside = far - squared * (far - 1.0);
  if (inside <= 0.0) return false;
  vec3 ray = vec3(at, -1.0) * ((sqrt(far) - sqrt(inside)) / squared);
  place = page_eye + page_look * ray;
  normal = place;
  return true;
}`;

const MESH = `
uniform sampler2D page_normals;
uniform sampler2D page_places;
bool page_surface(out vec3 place, out vec3 normal) {
  vec4 n = texelFetch(page_normals, ivec2(gl_FragCoord.xy), 0);
  normal = n.xyz;
  place = texelFetch(page_places, ivec2(gl_FragCoord.xy), 0).xyz;
  return n.w > 0.5;
}`;

// sRGB, its power by square roots: to 3e-5.
const TO_SCREEN = `
vec3 page_screen(vec3 rgb) {
  vec3 x = clamp(rgb, 0.0, 1.0);
  vec3 s = sqrt(x), q = sqrt(s);
  vec3 y = 0.653997 * s + 0.688686 * q - 0.318451 * sqrt(q) - 0.0201901 * x - 0.0040728;
  return mix(12.92 * x, y, step(0.0031308, x));
}`;

const LIGHTS = {
  point: `
vec3 page_lit(vec3 place, mat3 frame, vec3 wo, uint seed) {
  vec3 way = 5.0 * page_lamp - place;
  vec3 wi = normalize(way) * frame;
  return page_f_rgb(wi, wo) * abs(wi.z) * 3.14159265 * 16.0 / dot(way, way);
}`,
  // A square of side 2.4 at distance 4; its radiance gives the irradiance of the point light.
  area: `
const float SIDE = 2.4;
float page_square(vec3 place, vec3 way, mat3 square, out float distance2, out float cosine) {
  cosine = dot(way, square[2]);
  if (cosine <= 1e-4) return 0.0;
  float t = dot(4.0 * square[2] - place, square[2]) / cosine;
  vec3 hit = place + t * way - 4.0 * square[2];
  distance2 = t * t;
  return t > 0.0 && abs(dot(hit, square[0])) < 0.5 * SIDE && abs(dot(hit, square[1])) < 0.5 * SIDE ? 1.0 : 0.0;
}
vec3 page_lit(vec3 place, mat3 frame, vec3 wo, uint seed) {
  vec3 x = normalize(cross(vec3(0.0, 1.0, 0.0), page_lamp));
  mat3 square = mat3(x, cross(page_lamp, x), page_lamp);
  float radiance = 3.14159265 * 9.0 / (SIDE * SIDE);
  float area = SIDE * SIDE;
  vec2 u = page_point(seed, page_step) - 0.5;
  vec3 way = square * vec3(u * SIDE, 4.0) - place;
  float distance2 = dot(way, way);
  way /= sqrt(distance2);
  float cosine = dot(way, page_lamp);
  vec3 sum = vec3(0.0);
  if (cosine > 0.0) {
    vec3 wi = way * frame;
    float density = distance2 / (area * cosine);
    sum += page_f_rgb(wi, wo) * abs(wi.z) * radiance / (density + page_pdf(wi, wo));
  }
  vec3 wi, weight;
  float pdf;
  bool delta;
  page_draw(wo, page_point(seed ^ 0x9e3779b9u, page_step), wi, weight, pdf, delta);
  way = frame * wi;
  if ((pdf > 0.0 || delta) && page_square(place, way, square, distance2, cosine) > 0.0) {
    float density = distance2 / (area * cosine);
    sum += weight * radiance * (delta ? 1.0 : pdf / (pdf + density));
  }
  return sum;
}`,
  // A room by formula: sky, floor, and three round lamps that are sampled by their solid angles.
  environment: `
vec4 page_round(int k) { // axis, cosine of the half angle
  if (k == 0) return vec4(normalize(vec3(-0.55, 0.6, 0.6)), 0.93);
  if (k == 1) return vec4(normalize(vec3(0.85, 0.25, 0.35)), 0.975);
  return vec4(normalize(vec3(0.25, 0.7, -0.75)), 0.96);
}
vec3 page_glow(int k) { return k == 0 ? vec3(5.2, 5.0, 4.7) : k == 1 ? vec3(4.4, 5.0, 6.2) : vec3(5.6, 5.2, 4.6); }
vec3 page_sky(vec3 d) {
  float up = d.y;
  vec3 floor_ = mix(vec3(0.20, 0.19, 0.18), vec3(0.10), smoothstep(0.0, -0.9, up));
  vec3 wall = mix(vec3(0.34, 0.36, 0.39), vec3(0.15, 0.19, 0.27), smoothstep(0.0, 0.8, up));
  vec3 rgb = mix(floor_, wall, smoothstep(-0.015, 0.015, up));
  return rgb + vec3(0.25, 0.24, 0.22) * smoothstep(0.04, 0.0, abs(abs(d.x) - 0.35)) * step(0.0, -d.z) * step(0.0, up) * (1.0 - up);
}
vec3 page_turned(vec3 d) {
  float c = cos(page_azimuth), s = sin(page_azimuth);
  return vec3(c * d.x + s * d.z, d.y, c * d.z - s * d.x);
}
vec3 page_back(vec3 d) {
  float c = cos(page_azimuth), s = sin(page_azimuth);
  return vec3(c * d.x - s * d.z, d.y, c * d.z + s * d.x);
}
vec3 page_environment(vec3 d) {
  vec3 rgb = page_sky(d);
  for (int k = 0; k < 3; k++) { vec4 lamp = page_round(k); if (dot(d, lamp.xyz) > lamp.w) rgb += page_glow(k); }
  return rgb;
}
float page_lamps_pdf(vec3 d) {
  float sum = 0.0;
  for (int k = 0; k < 3; k++) { vec4 lamp = page_round(k); if (dot(d, lamp.xyz) > lamp.w) sum += 1.0 / (3.0 * 6.28318531 * (1.0 - lamp.w)); }
  return sum;
}
vec3 page_lit(vec3 place, mat3 frame, vec3 wo, uint seed) {
  vec2 u = page_point(seed, page_step);
  int k = int(3.0 * u.x);
  vec4 lamp = page_round(k);
  float z = mix(lamp.w, 1.0, fract(3.0 * u.x));
  float r = sqrt(max(0.0, 1.0 - z * z));
  vec3 x = normalize(cross(vec3(0.0, 1.0, 0.0), lamp.xyz));
  vec3 d = x * r * cos(6.2831853 * u.y) + cross(lamp.xyz, x) * r * sin(6.2831853 * u.y) + lamp.xyz * z;
  vec3 wi = page_back(d) * frame;
  float other = page_pdf(wi, wo);
  vec3 sum = page_f_rgb(wi, wo) * abs(wi.z) * page_environment(d) / (page_lamps_pdf(d) + other);
  vec3 weight;
  float pdf;
  bool delta;
  page_draw(wo, page_point(seed ^ 0x9e3779b9u, page_step), wi, weight, pdf, delta);
  if (pdf > 0.0 || delta) {
    d = page_turned(frame * wi);
    sum += weight * page_environment(d) * (delta ? 1.0 : pdf / (pdf + page_lamps_pdf(d)));
  }
  return sum;
}`,
};

/**
 * One sample of each pixel: rgb, and 1 in the fourth number where the shape is; samples are added up by blending.
 * With page_direct the sample is the picture itself.
 */
export function lit(light, type, isMesh) {
  const draw = light === "point" ? "" : `
void page_draw(vec3 wo, vec2 u, out vec3 wi, out vec3 weight, out float pdf, out bool delta) {
  ${type} all;
  page_sample_all(wo, u, wi, all, pdf, delta);
  weight = page_colour(all);
  if (page_hole(weight.x + weight.y + weight.z) || page_hole(wi.x)) { weight = vec3(0.0); pdf = 0.0; delta = false; wi = vec3(0.0, 0.0, 1.0); }
}`;
  return `
uniform vec3 page_lamp;
uniform float page_azimuth;
uniform int page_step;
uniform bool page_direct;
uniform float page_gain;
out vec4 page_out;
${SEEN}
${isMesh ? MESH : SPHERE}
${TO_SCREEN}
${RANDOM}
${draw}
${LIGHTS[light]}
void main() {
  vec3 place, normal;
  page_out = vec4(0.0);
  if (!page_surface(place, normal)) return;
  vec3 view = normalize(page_eye - place);
  vec3 tangent = normalize(cross(vec3(0.0, 1.0, 0.0), abs(normal.y) > 0.99999 ? vec3(1.0, 0.0, 0.0) : normal));
  mat3 frame = mat3(tangent, cross(normal, tangent), normal);
  vec3 wo = view * frame;
  vec3 rgb = vec3(0.0);
  uint seed = ${light === "point" ? "0u" : "page_hash(uint(gl_FragCoord.x) + 65536u * uint(gl_FragCoord.y))"};
  if (wo.z > 1e-4) rgb = page_lit(place, frame, wo, seed);
  if (page_hole(rgb.x + rgb.y + rgb.z)) rgb = vec3(0.0);
  page_out = vec4(page_direct ? page_screen(rgb * page_gain) : rgb, 1.0);
}`;
}

/** The picture of a sum of samples. */
export const TONE = `
uniform sampler2D page_sum;
uniform float page_gain;
uniform float page_steps;
out vec4 page_out;
${TO_SCREEN}
void main() {
  vec4 sum = texelFetch(page_sum, ivec2(gl_FragCoord.xy), 0);
  if (sum.w <= 0.0) { page_out = vec4(0.0); return; }
  float cover = sum.w / page_steps;
  page_out = vec4(page_screen(sum.rgb / sum.w * page_gain) * cover, cover);
}`;

export const MESH_VERTEX = `
uniform mat4 projectionMatrix;
uniform mat4 modelViewMatrix;
uniform mat4 modelMatrix;
in vec3 position;
in vec3 normal;
out vec3 page_place;
out vec3 page_normal;
void main() {
  page_place = (modelMatrix * vec4(position, 1.0)).xyz;
  page_normal = mat3(modelMatrix) * normal;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}`;

export const MESH_FRAGMENT = `
in vec3 page_place;
in vec3 page_normal;
layout(location = 0) out vec4 page_n;
layout(location = 1) out vec4 page_p;
uniform vec3 page_eye;
void main() {
  vec3 n = normalize(page_normal);
  if (dot(n, page_eye - page_place) < 0.0 && !gl_FrontFacing) n = -n;
  page_n = vec4(n, 1.0);
  page_p = vec4(page_place, 1.0);
}`;
