/** f over theta_h (to the right) and theta_d (upwards), phi_h = 0. */
export const SLICE = `
uniform vec2 page_size;
uniform float page_phi_d;
uniform float page_gain;
uniform float page_gamma;
out vec4 page_out;
void main() {
  vec2 angle = gl_FragCoord.xy / page_size * 1.57079633;
  vec3 d = vec3(sin(angle.y) * cos(page_phi_d), sin(angle.y) * sin(page_phi_d), cos(angle.y));
  vec3 h = vec3(sin(angle.x), 0.0, cos(angle.x));
  vec3 wi = vec3(h.z * d.x + h.x * d.z, d.y, h.z * d.z - h.x * d.x);
  vec3 wo = 2.0 * dot(h, wi) * h - wi;
  if (wi.z <= 0.0 || wo.z <= 0.0) { page_out = vec4(0.0); return; }
  vec3 rgb = page_f_rgb(wi, wo);
  if (page_hole(rgb.x)) { page_out = vec4(0.55, 0.2, 0.55, 1.0); return; }
  page_out = vec4(pow(clamp(rgb * page_gain, 0.0, 1.0), vec3(1.0 / page_gamma)), 1.0);
}`;
