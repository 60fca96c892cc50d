/** An element with attributes, listeners (`onclick`) and children; null children are left out. */
export function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else made.setAttribute(name, value === true ? "" : value);
  }
  made.append(...children.flat().filter((child) => child !== null && child !== undefined));
  return made;
}

/** A select whose options are [value, label] pairs. */
export function select(options, value, change, attributes = {}) {
  const made = element("select", attributes, options.map(([key, label]) => element("option", { value: key }, label)));
  made.value = value;
  made.addEventListener("change", () => change(made.value));
  return made;
}

/** A control with a short label before it. */
export function labelled(text, control) {
  return element("label", { class: "labelled" }, element("span", {}, text), control);
}

export function button(text, click, attributes = {}) {
  return element("button", { type: "button", onclick: click, ...attributes }, text);
}

export function download(name, content, type) {
  const link = element("a", { download: name, href: URL.createObjectURL(content instanceof Blob ? content : new Blob([content], { type })) });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
