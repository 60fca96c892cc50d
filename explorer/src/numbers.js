/** Numbers as the page writes them. */
export function written(value, digits = 4) {
  if (value === null || value === undefined) return "";
  if (Number.isNaN(value)) return "hole";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e5 || size < 1e-3) return value.toExponential(digits - 1).replace("e+", "e");
  return String(Number(value.toPrecision(digits)));
}

export function angleText(degrees, units, digits = 4) {
  if (units === "radians") return `${written((degrees * Math.PI) / 180, digits)} rad`;
  return `${written(degrees, digits)}°`;
}

const PI = { 0: "0", 30: "π/6", 45: "π/4", 60: "π/3", 90: "π/2", 120: "2π/3", 150: "5π/6", 180: "π" };

/** An angle on an axis. */
export function mark(degrees, units) {
  const sign = degrees < 0 ? "−" : "";
  return sign + (units === "radians" ? PI[Math.abs(degrees)] ?? written((Math.abs(degrees) * Math.PI) / 180, 3) : `${Math.abs(degrees)}°`);
}

const SUPER = { "-": "⁻", 0: "⁰", 1: "¹", 2: "²", 3: "³", 4: "⁴", 5: "⁵", 6: "⁶", 7: "⁷", 8: "⁸", 9: "⁹" };
export const power10 = (k) => (k === 0 ? "1" : k === 1 ? "10" : `10${[...String(k)].map((c) => SUPER[c]).join("")}`);

/** Round numbers between two ends, about `count` of them. */
export function ticks(from, to, count) {
  const rough = (to - from) / Math.max(1, count);
  if (!(rough > 0)) return [from];
  const unit = 10 ** Math.floor(Math.log10(rough));
  const step = unit * [1, 2, 2.5, 5, 10].find((k) => k * unit >= rough * 0.999);
  const first = Math.ceil(from / step - 1e-9);
  const all = [];
  for (let k = first; k * step <= to + 1e-9 * step; k++) all.push(Number((k * step).toPrecision(12)));
  return all;
}

export function debounced(wait, act) {
  let timer = 0;
  return (...given) => {
    clearTimeout(timer);
    timer = setTimeout(() => act(...given), wait);
  };
}
