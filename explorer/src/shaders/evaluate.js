/** f at every texel of two textures of directions; block k of the height holds the channels 4k to 4k + 3. */
export const EVALUATE = `
uniform sampler2D page_wi;
uniform sampler2D page_wo;
uniform int page_height;
out vec4 page_out;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  int block = at.y / page_height;
  ivec2 from = ivec2(at.x, at.y - block * page_height);
  page_out = page_four(page_f(texelFetch(page_wi, from, 0).xyz, texelFetch(page_wo, from, 0).xyz), 4 * block);
}`;
