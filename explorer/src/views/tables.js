import { button, element } from "../dom.js";
import { written } from "../numbers.js";
import { MIXTURES } from "../ui/add.js";
import { View } from "./view.js";

/** A view of text: a block for each material, made when the materials change. */
class TextView extends View {
  changed(kind, material) {
    if (kind === "materials" || kind === "values" || kind === "size") super.changed();
    if (kind === "materials") this.build();
    if (kind === "values") this.old(material);
  }

  build() {
    this.body.replaceChildren(...this.app.materials.map((material) => this.block(material)));
  }

  old() {}

  draw() {
    return false;
  }
}

const heading = (material) => element("h3", {}, element("i", { style: `background:${material.colour}` }), material.title);

/** The laws of physics, as gn.check verifies them. */
export class Laws extends TextView {
  static key = "laws";
  static title = "Laws";

  block(material) {
    const table = element("div", { class: "table" });
    const run = button("check", () => this.check(material, table, run), { class: "primary", "aria-label": `Check ${material.title}` });
    const block = element("article", { "data-testid": `check-${material.index}` }, element("div", { class: "row" }, heading(material), run), table);
    if (material.checked) table.replaceChildren(tableOf(material.checked));
    this.blocks ??= new Map();
    this.blocks.set(material, { run, table });
    return block;
  }

  old(material) {
    if (!material) return;
    const { table } = this.blocks?.get(material) ?? {};
    if (material.checked && table) table.classList.add("old");
  }

  async check(material, table, run) {
    run.disabled = true;
    run.textContent = "checking …";
    try {
      material.checked = await this.app.ask("check", material, {}, `check ${material.index}`);
      table.classList.remove("old");
      if (material.checked) table.replaceChildren(tableOf(material.checked));
    } catch (error) {
      this.app.errors.show(error);
    }
    run.disabled = false;
    run.textContent = "check";
  }
}

const SIGNS = { pass: "✓", "not significant": "≈", breaks: "○", FAIL: "✗" };

function tableOf({ rows }) {
  const cell = (value) => (typeof value === "number" ? written(value) : value ?? "");
  return element(
    "table",
    {},
    element("thead", {}, element("tr", {}, ["law", "verdict", "measured", "tolerance"].map((one) => element("th", { scope: "col" }, one)))),
    element(
      "tbody",
      {},
      rows.flatMap((row) => [
        element(
          "tr",
          { class: `verdict-${String(row.verdict).replace(/\W+/g, "-")}` },
          element("th", { scope: "row" }, row.law),
          element("td", { class: "verdict" }, `${SIGNS[row.verdict] ?? "–"} ${row.verdict}`),
          element("td", { class: "number" }, cell(row.measured)),
          element("td", { class: "number" }, cell(row.tolerance)),
        ),
        element("tr", {}, element("td", { class: "finding", colspan: "4" }, [row.finding, row.reason].filter(Boolean).join("; "))),
      ]),
    ),
  );
}

/** A model fitted to a material, and added beside it. */
export class Fitting extends TextView {
  static key = "fit";
  static title = "Fit";

  block(material) {
    const model = element("input", { type: "text", value: material.model ?? MIXTURES[0], list: "fitted", "aria-label": `Model to fit to ${material.title}`, spellcheck: "false" });
    const result = element("div", { class: "table" }, material.fitted ? this.told(material.fitted) : []);
    const run = button("fit", () => this.fit(material, model.value, result, run), { class: "primary" });
    model.addEventListener("keydown", (event) => event.key === "Enter" && run.click());
    return element(
      "article",
      { "data-testid": `fit-${material.index}` },
      heading(material),
      element("div", { class: "row" }, model, run),
      result,
    );
  }

  async fit(material, model, result, run) {
    run.disabled = true;
    run.textContent = "fitting …";
    material.model = model;
    try {
      const answer = await this.app.ask("fit", material, { model }, `fit ${material.index}`);
      material.fitted = answer ?? material.fitted;
      if (answer) result.replaceChildren(...this.told(answer));
    } catch (error) {
      this.app.errors.show(error);
    }
    run.disabled = false;
    run.textContent = "fit";
  }

  told(answer) {
    const one = ({ name, value, u }) =>
      element("tr", {}, element("th", { scope: "row" }, name), element("td", { class: "number" }, [value].flat().map((x) => written(x)).join("  ")), element("td", { class: "number" }, u === null || u === undefined ? "" : `± ${[u].flat().map((x) => written(x, 2)).join("  ")}`));
    return [
      element("table", {}, element("tbody", {}, answer.numbers.map(one), element("tr", {}, element("th", { scope: "row" }, "RMS residual"), element("td", { class: "number" }, written(answer.rms)), element("td", {}))), element("caption", {}, element("code", {}, answer.expression))),
      button("add beside it", () => this.app.adopt(answer.material), { class: "primary", "data-testid": "adopt" }),
      answer.text ? element("details", {}, element("summary", {}, "as printed"), element("pre", {}, answer.text)) : null,
    ].filter(Boolean);
  }
}

/** What the material is, where it comes from, and where it stands in Python. */
export class Facts extends TextView {
  static key = "facts";
  static title = "Facts";

  block(material) {
    const facts = Object.entries(flattened(material.facts ?? {}));
    const tags = [material.class, material.measured ? "measured" : "formula", material.isotropic ? "isotropic" : "anisotropic", material.twoSided ? "lets light through" : null, material.has_delta ? "mirrors a part exactly" : null, material.polarized ? "polarizes" : null, material.channels ? `${material.channels} channels` : null].filter(Boolean);
    return element(
      "article",
      { "data-testid": `facts-${material.index}` },
      heading(material),
      element("p", { class: "tags" }, tags.map((one) => element("span", {}, one))),
      material.why ? element("p", { class: "why" }, material.why) : null,
      material.formula ? element("pre", { class: "formula" }, material.formula) : null,
      material.description ? element("p", {}, material.description) : null,
      material.source ? element("p", { class: "source" }, material.source) : null,
      facts.length ? element("table", {}, element("tbody", {}, facts.map(([name, value]) => element("tr", {}, element("th", { scope: "row" }, name), element("td", {}, value))))) : null,
    );
  }
}

function flattened(value, before = "") {
  const all = {};
  for (const [key, one] of Object.entries(value)) {
    const name = before ? `${before}, ${key}` : key;
    if (one === null || one === undefined) continue;
    if (Array.isArray(one)) all[name] = one.map((x) => (typeof x === "number" ? written(x) : typeof x === "object" ? JSON.stringify(x) : String(x))).join("  ");
    else if (typeof one === "object") Object.assign(all, flattened(one, name));
    else all[name] = typeof one === "number" ? written(one, 5) : String(one);
  }
  return all;
}
