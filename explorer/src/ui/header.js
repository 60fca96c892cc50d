import { button, element, labelled, select } from "../dom.js";
import { VIEWS } from "../views/index.js";
import { help } from "./help.js";
import { rangeControl } from "./range.js";

/** The bar above everything: incidence, channel, which views are shown, units, theme. */
export function header(app) {
  const { state } = app;
  const incidence = element("div", { class: "incidence", role: "group", "aria-label": "Incidence" });
  const views = element("nav", { class: "views", "aria-label": "Views" });
  const channel = element("span", {});
  const units = select([["degrees", "degrees"], ["radians", "radians"]], state.units, (value) => app.setUnits(value), { "data-testid": "units", "aria-label": "Units of angles" });
  const theme = select([["auto", "system"], ["light", "light"], ["dark", "dark"]], state.theme, (value) => app.theme.choose(value), { "data-testid": "theme", "aria-label": "Theme" });
  const made = element(
    "header",
    { class: "top" },
    element("div", { class: "line" }, element("h1", {}, "gonio"), incidence, channel, element("span", { class: "space" }), units, theme, button("?", help, { "aria-label": "Keyboard and help", title: "Keyboard and help", "data-testid": "help" })),
    views,
  );
  let rows = {};
  const angle = (key, label, high, testid) => {
    const radians = state.units === "radians";
    const factor = radians ? Math.PI / 180 : 1;
    const row = rangeControl({ label, unit: radians ? "rad" : "°", low: 0, high: high * factor, step: radians ? 0.001 : 0.1, value: state[key] * factor, testid: null, change: (x) => app.setIncidence(...(key === "theta" ? [x / factor, state.phi] : [state.theta, x / factor])), beyond: (x) => app.errors.show(`${label} = ${x}: expected a number from 0 to ${Number((high * factor).toPrecision(4))} ${radians ? "radians" : "degrees"}`) });
    row.querySelector("input[type=range]").setAttribute("data-testid", `${testid}-slider`);
    row.querySelector("input[type=number]").setAttribute("data-testid", testid);
    row.factor = factor;
    return row;
  };
  made.units = () => {
    units.value = state.units;
    rows = { theta: angle("theta", "θᵢ", 89.5, "theta-i"), phi: angle("phi", "φᵢ", 360, "phi-i") };
    incidence.replaceChildren(rows.theta, rows.phi);
  };
  made.incidence = () => Object.entries(rows).forEach(([key, row]) => row.show(state[key] * row.factor));
  made.materials = () => {
    const widest = app.materials.filter((one) => one.glsl).reduce((most, one) => (one.components > (most?.components ?? 1) ? one : most), null);
    channel.replaceChildren();
    if (widest) {
      const choices = [["-1", "luminance"], ...Array.from({ length: widest.components }, (_, k) => [String(k), String(widest.channelName(k))])];
      channel.append(labelled("channel", select(choices, String(Math.min(state.channel, widest.components - 1)), (value) => app.setChannel(Number(value)), { "data-testid": "channel" })));
    }
    views.replaceChildren(...VIEWS.map((View) => viewButton(app, View)));
  };
  made.units();
  return made;
}

function viewButton(app, View) {
  const useful = !app.materials.length || app.materials.some(View.needs);
  const on = app.state.views.includes(View.key);
  return button(View.title, () => app.toggle(View.key), { "aria-pressed": String(on), "data-testid": `view-${View.key}`, disabled: !useful, title: useful ? null : "No material here has one" });
}
