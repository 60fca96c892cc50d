import { button, element } from "../dom.js";

/** What is fitted most: the first is proposed. */
export const MIXTURES = ["Lambertian(0.3) + Microfacet(GGX(0.2))", "Lambertian(0.3) + Ward(0.2, 0.2)", "Lambertian(0.3)"];

/** The field that adds a material: a name of the list, an expression, or a file. */
export function adder(app) {
  const field = element("input", { type: "text", list: "known", placeholder: "material, model or expression", "aria-label": "Material to add: a name, an expression or a path", "data-testid": "add", spellcheck: "false", autocomplete: "off" });
  const known = element("datalist", { id: "known" });
  const fitted = element("datalist", { id: "fitted" });
  const add = () => {
    const text = field.value.trim();
    if (!text) return;
    app.add(text).then((added) => added && (field.value = ""));
  };
  field.addEventListener("keydown", (event) => event.key === "Enter" && add());
  const file = element("input", { type: "file", hidden: true, "aria-hidden": "true", tabindex: -1, onchange: () => { app.dropped(file.files); file.value = ""; } });
  const made = element(
    "div",
    { class: "adder" },
    field,
    known,
    fitted,
    button("Add", add, { class: "primary" }),
    button("File…", () => file.click(), { "data-testid": "drop", title: "A file of measurements; it can also be dropped anywhere on the page" }),
    file,
  );
  made.fill = ({ given = [], materials, models }) => {
    fitted.replaceChildren(...MIXTURES.map((value) => element("option", { value })), ...models.map(({ example, doc }) => element("option", { value: example, label: doc })));
    known.replaceChildren(
      ...given.map(({ text, title }) => element("option", { value: text, label: title })),
      ...materials.map(({ name, kind, description }) => element("option", { value: name, label: `${kind}: ${description}` })),
      ...models.map(({ example, doc }) => element("option", { value: example, label: doc })),
    );
  };
  made.focusField = () => field.focus();
  return made;
}

/** Files dropped anywhere are read; while one hangs over the page, the page says so. */
export function receiveFiles(app) {
  const veil = element("div", { class: "veil", hidden: true }, element("p", {}, "Drop a file of measurements"));
  document.body.append(veil);
  let inside = 0;
  const files = (event) => [...(event.dataTransfer?.types ?? [])].includes("Files");
  const over = (change) => (event) => {
    if (!files(event)) return;
    event.preventDefault();
    inside = Math.max(0, inside + change);
    veil.hidden = inside === 0;
  };
  addEventListener("dragenter", over(1));
  addEventListener("dragleave", over(-1));
  addEventListener("dragover", over(0));
  addEventListener("drop", (event) => {
    if (!files(event)) return;
    event.preventDefault();
    inside = 0;
    veil.hidden = true;
    app.dropped(event.dataTransfer.files);
  });
}
