import { button, download, element } from "../dom.js";

/** Text to read, copy or save, in a dialog. */
export function textDialog(title, text, file) {
  const copied = element("span", { class: "hint", role: "status" });
  const copy = button("Copy", async () => {
    copied.textContent = (await copyText(text)) ? "copied" : "select the text and copy it";
  }, { class: "primary" });
  show(
    title,
    element("pre", { tabindex: 0, class: "code" }, text),
    element("div", { class: "row" }, copy, file ? button(`Save ${file}`, () => download(file, text, "text/plain")) : null, copied),
  );
}

export async function copyText(text) {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    return false;
  }
}

/** A modal dialog, which Escape closes. */
export function show(title, ...content) {
  const close = button("✕", () => dialog.close(), { "aria-label": "Close" });
  const dialog = element("dialog", { "aria-label": title }, element("header", {}, element("h2", {}, title), close), ...content);
  dialog.addEventListener("close", () => dialog.remove());
  dialog.addEventListener("click", (event) => event.target === dialog && dialog.close());
  document.body.append(dialog);
  dialog.showModal();
  return dialog;
}
