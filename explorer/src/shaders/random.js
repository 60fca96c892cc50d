/** Points in the square: the R2 sequence, moved at random from pixel to pixel. */
export const RANDOM = `
uint page_hash(uint x) {
  x = x * 747796405u + 2891336453u;
  x = ((x >> ((x >> 28u) + 4u)) ^ x) * 277803737u;
  return (x >> 22u) ^ x;
}
vec2 page_point(uint seed, int k) {
  uint a = page_hash(seed);
  vec2 moved = vec2(a, page_hash(a)) / 4294967296.0;
  return min(fract(moved + float(k) * vec2(0.7548776662, 0.5698402910)), vec2(0.99999994));
}`;
