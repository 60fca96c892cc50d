import { button, element } from "../dom.js";

/** The banner for errors, in the words of gonio; the page goes on below it. */
export class Errors {
  constructor() {
    this.text = element("pre", {});
    this.element = element("div", { class: "error", role: "alert", "data-testid": "error", hidden: true }, this.text, button("✕", () => this.hide(), { "aria-label": "Dismiss the error" }));
  }

  show(error) {
    this.text.textContent = error instanceof Error ? error.message : String(error);
    this.element.hidden = false;
  }

  hide() {
    this.element.hidden = true;
  }
}
