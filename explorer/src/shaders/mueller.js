/** The sixteen elements over the hemisphere of outgoing directions, seen from above: radius = theta / 90 degrees. */
export const MUELLER = `
uniform vec2 page_size;
uniform vec3 page_incident;
uniform int page_relative;
out vec4 page_out;
const vec3 LOW = vec3(0.019, 0.188, 0.478);
const vec3 HIGH = vec3(0.545, 0.102, 0.059);
vec3 diverging(float x) {
  vec3 end = x < 0.0 ? LOW : HIGH;
  vec3 middle = x < 0.0 ? vec3(0.32, 0.60, 0.82) : vec3(0.93, 0.52, 0.33);
  float t = min(abs(x), 1.0);
  return t < 0.5 ? mix(vec3(0.965), middle, 2.0 * t) : mix(middle, end, 2.0 * t - 1.0);
}
void main() {
  vec2 cell = 4.0 * gl_FragCoord.xy / page_size;
  int column = int(cell.x);
  int row = 3 - int(cell.y);
  vec2 at = (fract(cell) - 0.5) * 2.0 / 0.9;
  float r = length(at);
  if (r >= 1.0) { page_out = vec4(0.0); return; }
  float theta = r * 1.57079633;
  vec2 around = r > 1e-6 ? at / r : vec2(1.0, 0.0);
  vec3 wo = vec3(sin(theta) * around, cos(theta));
  float value = page_mueller(page_incident, wo, 4 * row + column);
  if (page_relative == 1) {
    float whole = page_mueller(page_incident, wo, 0);
    if (row + column > 0) value /= max(whole, 1e-30);
  }
  vec3 rgb = page_hole(value) ? vec3(0.55, 0.2, 0.55) : diverging(value);
  page_out = vec4(rgb, 1.0) * clamp((1.0 - r) * 0.5 * 0.9 * page_size.x / 4.0, 0.0, 1.0);
}`;
