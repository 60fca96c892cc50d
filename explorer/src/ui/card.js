import { button, element, labelled, select } from "../dom.js";
import { askDialog } from "./ask.js";
import { exportMenu } from "./export.js";
import { rangeControl } from "./range.js";

/** A material in the list: its colour and name, its numbers and options, and what can be done with it. */
export function card(app, material) {
  const body = element("div", { class: "fields" });
  const fill = () => {
    body.replaceChildren(
      ...material.options.map((option) => optionControl(app, material, option)),
      ...material.parameters.map((parameter) => parameterControl(app, material, parameter)),
      ...(material.why ? [element("p", { class: "why" }, material.why)] : []),
      ...(material.parameters.length || material.options.length || material.why ? [] : [element("p", { class: "hint" }, material.measured ? "A measurement: it has no numbers to turn." : "This material has no numbers to turn.")]),
    );
  };
  fill();
  return element(
    "article",
    { class: "card", style: `--colour:${material.colour}`, "aria-label": material.title, "data-testid": `material-${material.index}` },
    element(
      "header",
      {},
      element("i", { "aria-hidden": "true" }),
      element("h2", { title: material.title }, material.title),
      button("✕", () => app.remove(material), { class: "quiet", "aria-label": `Remove ${material.title}`, "data-testid": `remove-${material.index}` }),
    ),
    material.description ? element("p", { class: "about" }, material.description) : null,
    body,
    element(
      "footer",
      {},
      button("Check", () => app.open("laws"), { title: "Verify the laws of physics" }),
      button("Fit", () => app.open("fit"), { title: "Fit a model to it" }),
      app.offline ? null : button("Ask", () => askDialog(app, material).catch((error) => app.errors.show(error)), { title: "Any function of gonio that is asked of a material" }),
      exportMenu(app, material),
      Object.keys(material.entry.replaced).length ? button("Reset", () => app.reset(material), { class: "quiet", title: "Numbers as they were" }) : null,
    ),
  );
}

/** The last part of a path, where it alone says which number is meant. */
function shortened(material, path) {
  const last = (one) => one.slice(one.lastIndexOf(".") + 1);
  const all = [...material.parameters, ...material.options].map((one) => one.path);
  return all.filter((one) => last(one) === last(path)).length > 1 ? path : last(path);
}

function optionControl(app, material, { path, value, choices, doc }) {
  const control = select(choices.map((one) => [String(one), String(one)]), String(value), (chosen) => app.setOption(material, path, choices.find((one) => String(one) === chosen)), { "data-testid": `option-${path}-${material.index}`, title: doc });
  return labelled(shortened(material, path), control);
}

function parameterControl(app, material, parameter) {
  const { path, low, high, unit, doc, scale } = parameter;
  const value = material.values.get(path);
  const shared = { low, high, scale, unit: unit && unit !== "1" ? unit : "", title: `${path}: ${doc}`, label: shortened(material, path) };
  const beyond = (x) => app.setParameter(material.index, path, x);
  if (!Array.isArray(value)) {
    return rangeControl({ ...shared, value, testid: `parameter-${path}-${material.index}`, name: `${path} of ${material.title}`, change: (x) => app.setParameter(material.index, path, x), beyond });
  }
  return channelControl(app, material, parameter, value, shared);
}

/** Numbers by channel: one slider that scales them all, and a slider for each channel. */
function channelControl(app, material, { path }, start, shared) {
  const values = [...start];
  const few = values.length <= 4;
  const set = (k, x) => {
    values[k] = x;
    app.setParameter(material.index, path, [...values]);
  };
  const each = values.map((value, k) =>
    rangeControl({ ...shared, unit: "", label: material.components === values.length ? String(material.channelName(k)) : String(k), value, name: `${path}, ${k}, of ${material.title}`, testid: `parameter-${path}.${k}-${material.index}`, change: (x) => set(k, x), beyond: (x) => set(k, x) }));
  const middle = values.reduce((sum, x) => sum + x, 0) / values.length;
  const all = rangeControl({
    ...shared, value: middle, name: `${path} of ${material.title}, mean of all channels`, testid: `parameter-${path}-${material.index}`,
    change: (x) => {
      const mean = values.reduce((sum, y) => sum + y, 0) / values.length;
      values.forEach((y, k) => (values[k] = Math.min(shared.high, Math.max(shared.low, mean > 0 ? (y * x) / mean : x))));
      each.forEach((row, k) => row.show(values[k]));
      app.setParameter(material.index, path, [...values]);
    },
  });
  return element("details", { class: "channels", open: few && values.length > 1 ? false : null }, element("summary", { "aria-label": `Channels of ${path}` }, all), element("div", { class: "each" }, each));
}
