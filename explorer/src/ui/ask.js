import { button, element, labelled, select } from "../dom.js";
import { show } from "./dialog.js";

let functions;

/** A form of a public function of gonio, made from its signature: choose one, fill in, read the result. */
export async function askDialog(app, material) {
  functions ??= (await app.server.call("functions", {}, "functions")).functions;
  const about = element("p", { class: "hint" });
  const fields = element("div", { class: "fields" });
  const result = element("pre", { class: "code", tabindex: 0, role: "status", "data-testid": "ask-result", hidden: true });
  let chosen;
  let controls;
  const choose = (name) => {
    chosen = functions.find((one) => one.name === name);
    about.textContent = chosen.doc;
    controls = chosen.fields.map((field) => [field, control(field)]);
    fields.replaceChildren(...controls.map(([field, input]) => labelled(field.unit ? `${field.name} [${field.unit}]` : field.name, input)));
    result.hidden = true;
  };
  const ask = async () => {
    const given = Object.fromEntries(controls.map(([{ name }, input]) => [name, input.value.trim()]).filter(([, value]) => value));
    result.textContent = "…";
    result.hidden = false;
    try {
      result.textContent = (await app.ask("ask", material, { function: chosen.name, given }, "ask")).text;
    } catch (error) {
      result.textContent = error.message;
    }
  };
  const form = element(
    "form",
    { onsubmit: (event) => { event.preventDefault(); ask(); } },
    labelled("function", select(functions.map(({ name }) => [name, name]), functions[0].name, choose, { "data-testid": "ask-function" })),
    about,
    fields,
    element("button", { type: "submit", class: "primary", "data-testid": "ask-go" }, "Ask"),
  );
  choose(functions[0].name);
  show(`Ask about ${material.title}`, form, result);
}

/** What a value is typed into: the words that there are, or a text that says what is expected. */
function control({ name, doc, expected, default: usual, words }) {
  const attributes = { title: `${doc}: ${expected}`, "data-testid": `ask-${name}` };
  if (words.length) return select(words.map((word) => [word, word]), usual.toLowerCase() || words[0], () => {}, attributes);
  return element("input", { ...attributes, placeholder: usual || expected, autocomplete: "off" });
}
