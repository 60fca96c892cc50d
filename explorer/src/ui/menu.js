import { button, element } from "../dom.js";

/** A button that opens a list of actions; arrow keys move in it, Escape closes it. `items`: [label, act] or a heading. */
export function menu(label, items, attributes = {}) {
  const list = element("div", { class: "menu", role: "menu", hidden: true });
  const open = button(label, () => (list.hidden ? show() : hide()), { "aria-haspopup": "menu", "aria-expanded": "false", ...attributes });
  const entries = () => [...list.querySelectorAll("[role=menuitem]")];
  const outside = (event) => !box.contains(event.target) && hide();
  const show = () => {
    list.replaceChildren(
      ...items().map((item) =>
        typeof item === "string"
          ? element("p", { role: "presentation" }, item)
          : button(item[0], () => { hide(); open.focus(); item[1](); }, { role: "menuitem" }),
      ),
    );
    list.hidden = false;
    place();
    open.setAttribute("aria-expanded", "true");
    entries()[0]?.focus();
    document.addEventListener("pointerdown", outside);
  };
  /** Below the button or above it, within the window. */
  const place = () => {
    const at = open.getBoundingClientRect();
    const { width, height } = list.getBoundingClientRect();
    list.style.left = `${Math.max(4, Math.min(at.left, innerWidth - width - 4))}px`;
    const below = at.bottom + 3 + height <= innerHeight;
    list.style.top = `${below ? at.bottom + 3 : Math.max(4, Math.min(at.top - height - 3, innerHeight - height - 4))}px`;
  };
  const hide = () => {
    list.hidden = true;
    open.setAttribute("aria-expanded", "false");
    document.removeEventListener("pointerdown", outside);
  };
  const box = element("span", { class: "menubox" }, open, list);
  box.addEventListener("keydown", (event) => {
    if (list.hidden) return;
    const all = entries();
    const at = all.indexOf(document.activeElement);
    const to = { ArrowDown: at + 1, ArrowUp: at - 1, Home: 0, End: -1 }[event.key];
    if (to !== undefined) all.at(to % all.length).focus();
    else if (event.key === "Escape") { hide(); open.focus(); }
    else return;
    event.preventDefault();
    event.stopPropagation();
  });
  return box;
}
