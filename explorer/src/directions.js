/** Directions are unit vectors [x, y, z] in the local frame, z is the normal; angles are in degrees. */
export const DEGREE = Math.PI / 180;

export function direction(theta, phi) {
  const [t, p] = [theta * DEGREE, phi * DEGREE];
  return [Math.sin(t) * Math.cos(p), Math.sin(t) * Math.sin(p), Math.cos(t)];
}

export function angles([x, y, z]) {
  return [Math.atan2(Math.hypot(x, y), z) / DEGREE, (Math.atan2(y, x) / DEGREE + 360) % 360];
}

export function mirror([x, y, z]) {
  return [-x, -y, z];
}

/**
 * Angles of a plane through the normal, ascending: every quarter of a degree, and ten times as fine around `peaks`.
 * The whole circle where there is a back side, else the half above the horizon.
 */
export function planeAngles(whole, peaks) {
  const end = whole ? 180 : 90;
  const all = new Set();
  const add = (from, to, step) => {
    for (let k = Math.round(from / step); k <= Math.round(to / step); k++) {
      const angle = Math.round(k * step * 1000) / 1000;
      if (Math.abs(angle) < end || (whole && angle === end)) all.add(angle);
    }
  };
  add(-end, end, 0.25);
  for (const peak of peaks) add(peak - 4, peak + 4, 0.025);
  return [...all].sort((a, b) => a - b);
}

/** The direction at a signed angle from the normal in the half-planes of azimuth `phi` (positive) and phi + 180 (negative). */
export function inPlane(angle, phi) {
  return direction(Math.abs(angle), angle >= 0 ? phi : phi + 180);
}

/** Incident and outgoing directions of Rusinkiewicz's angles, with phi_h = 0. */
export function fromHalf(thetaH, thetaD, phiD) {
  const [dx, dy, dz] = direction(thetaD, phiD);
  const [s, c] = [Math.sin(thetaH * DEGREE), Math.cos(thetaH * DEGREE)];
  const h = [s, 0, c];
  const wi = [c * dx + s * dz, dy, c * dz - s * dx];
  const along = 2 * (h[0] * wi[0] + h[2] * wi[2]);
  return [wi, h.map((x, k) => along * x - wi[k])];
}
