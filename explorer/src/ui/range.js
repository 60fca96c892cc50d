import { element } from "../dom.js";
import { written } from "../numbers.js";

const STEPS = 1000;

/** A slider with its number beside it. `change(value, done)` is told of every value. */
export function rangeControl({ label, unit = "", low, high, scale = "linear", step = null, value, change, beyond, testid, title, name }) {
  const log = scale === "log" && low > 0;
  const to = (x) => (log ? Math.log(x / low) / Math.log(high / low) : (x - low) / (high - low)) * STEPS;
  const from = (p) => {
    const x = log ? low * (high / low) ** (p / STEPS) : low + ((high - low) * p) / STEPS;
    return step ? Math.round(x / step) * step : Number(x.toPrecision(4));
  };
  const spoken = name ?? label;
  const slider = element("input", { type: "range", min: 0, max: STEPS, step: step && !log ? (STEPS * step) / (high - low) : 1, "aria-label": spoken, "data-testid": testid });
  const number = element("input", { type: "number", step: step ?? nice((high - low) / 100), "aria-label": `${spoken}, number`, "data-testid": testid?.replace(/^parameter/, "number") ?? null });
  const show = (x) => {
    slider.value = to(Math.min(Math.max(x, low), high));
    slider.setAttribute("aria-valuetext", `${written(x)} ${unit}`.trim());
    if (document.activeElement !== number) number.value = written(x);
  };
  slider.addEventListener("input", () => {
    const x = from(Number(slider.value));
    number.value = written(x);
    slider.setAttribute("aria-valuetext", `${written(x)} ${unit}`.trim());
    change(x);
  });
  const entered = () => {
    const x = Number(number.value);
    if (number.value === "" || Number.isNaN(x)) return;
    if ((x < low || x > high) && beyond) return beyond(x);
    if (x < low || x > high) return;
    slider.value = to(x);
    change(x);
  };
  number.addEventListener("input", () => { if (Number(number.value) >= low && Number(number.value) <= high) entered(); });
  number.addEventListener("change", entered);
  const row = element(
    "div",
    { class: "range", title },
    label ? element("span", { class: "name" }, label, unit ? element("small", {}, ` ${unit}`) : null) : null,
    slider,
    number,
  );
  row.show = show;
  show(value);
  return row;
}

function nice(x) {
  return 10 ** Math.round(Math.log10(x));
}
