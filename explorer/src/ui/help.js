import { element } from "../dom.js";
import { show } from "./dialog.js";
import { VIEWS } from "../views/index.js";

const KEYS = [
  ["?", "this sheet"],
  ["a", "add a material"],
  ["1 … 9, 0", "show or hide a view, in the order of the bar"],
  ["[ ]", "incidence θᵢ by 1°; with Shift by 5°"],
  [", .", "azimuth φᵢ by 5°"],
  ["l", "next light"],
  ["s", "next shape"],
  ["g", "linear or logarithmic plots"],
  ["u", "degrees or radians"],
  ["t", "light or dark"],
  ["Escape", "dismiss an error; all views again"],
  ["arrows", "on a slider: a step; on a lobe: move the light, with Shift turn the view; on a lit shape: move the light, with Shift turn the shape; on a plot: move the cursor"],
];

export function help() {
  show(
    "Keyboard",
    element("table", { class: "keys" }, element("tbody", {}, KEYS.map(([key, what]) => element("tr", {}, element("th", { scope: "row" }, element("kbd", {}, key)), element("td", {}, what))))),
    element("p", {}, "f is the BRDF in 1/sr, without a cosine. ωᵢ points to the light, ωₒ to the viewer; θ is measured from the normal. The point light gives an irradiance of π at the middle of the shape: a white Lambertian surface is 1 there. The anisotropy of shapes follows their vertical axis; light is scattered once, without shadows."),
    element("p", {}, "The address holds everything that is set here: keep it, or reload it."),
  );
}

/** Keys that work wherever no field is being written in. */
export function shortcuts(app) {
  const turn = (key, all) => (app.state[key] = all[(all.indexOf(app.state[key]) + 1) % all.length]);
  const acts = {
    "?": help,
    a: () => app.adder.focusField(),
    "[": () => app.move(-1, 0), "]": () => app.move(1, 0), "{": () => app.move(-5, 0), "}": () => app.move(5, 0),
    ",": () => app.move(0, -5), ".": () => app.move(0, 5),
    l: () => app.again("light", turn("light", ["point", "area", "environment"])),
    s: () => app.again("shape", turn("shape", ["sphere", "teapot", "knot"])),
    g: () => { app.state.plane.scale = app.state.plane.scale === "log" ? "linear" : "log"; app.change("plane"); },
    u: () => app.setUnits(app.state.units === "degrees" ? "radians" : "degrees"),
    t: () => app.chooseTheme(app.theme.dark ? "light" : "dark"),
    Escape: () => { app.errors.hide(); if (app.state.alone) app.alone(app.state.alone); },
  };
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
    const { target } = event;
    const writing = target instanceof HTMLInputElement && target.type !== "range" && target.type !== "checkbox";
    if (writing || target instanceof HTMLSelectElement || target instanceof HTMLTextAreaElement) return;
    const digit = /^[0-9]$/.test(event.key) ? (Number(event.key) + 9) % 10 : -1;
    const act = digit >= 0 ? () => VIEWS[digit] && app.toggle(VIEWS[digit].key) : acts[event.key];
    if (!act) return;
    event.preventDefault();
    act();
  });
}
