/** Everything that the address holds. Angles are in degrees, whatever the page shows. */
const DEFAULTS = {
  materials: [], // {text, replaced: {path: value}}
  theta: 45,
  phi: 0,
  views: ["lobe", "lit", "polar", "slice"],
  alone: null, // the view that fills the page
  channel: -1, // -1: luminance
  lobe: { radius: "linear", layout: "together", size: "common" },
  camera: [2.5, -3.0, 1.9],
  light: "point",
  shape: "sphere",
  lamp: [35, 40], // azimuth to the right of the viewer, elevation
  turn: 0, // of the shape
  exposure: 0,
  plane: { scale: "linear", angles: [], across: true },
  slice: { exposure: 0, gamma: 2.2 },
  spectrum: "mirror",
  mueller: "relative",
  theme: "auto",
  units: "degrees",
};

const copy = (value) => JSON.parse(JSON.stringify(value));
const equal = (a, b) => JSON.stringify(a) === JSON.stringify(b);

export function defaults() {
  return copy(DEFAULTS);
}

/** The state in an address' fragment; what is missing or of another kind has its default. */
export function read(fragment) {
  const state = defaults();
  let given = {};
  try {
    given = JSON.parse(decodeURIComponent(fragment.replace(/^#/, "")) || "{}");
  } catch {
    return state;
  }
  for (const key of Object.keys(state)) {
    const like = state[key];
    const value = given[key];
    if (value === undefined) continue;
    if (Array.isArray(like) !== Array.isArray(value)) continue;
    if (like !== null && typeof like !== typeof value) continue;
    state[key] = like !== null && typeof like === "object" && !Array.isArray(like) ? { ...like, ...value } : value;
  }
  state.materials = state.materials
    .map((one) => (typeof one === "string" ? { text: one } : one))
    .filter((one) => typeof one?.text === "string")
    .map((one) => ({ text: one.text, replaced: one.replaced ?? {} }));
  return state;
}

/** The fragment that holds a state: what differs from the defaults, as JSON. */
export function written(state) {
  const short = {};
  for (const key of Object.keys(DEFAULTS)) if (!equal(state[key], DEFAULTS[key])) short[key] = state[key];
  if (short.materials) short.materials = short.materials.map((one) => (Object.keys(one.replaced).length ? one : { text: one.text }));
  return "#" + encodeURIComponent(JSON.stringify(short)).replace(/%(7B|7D|22|3A|2C|5B|5D)/g, (c) => decodeURIComponent(c));
}
