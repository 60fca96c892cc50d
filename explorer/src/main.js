import "./explorer.css";
import { decoded } from "./arrays.js";
import { App } from "./app.js";
import { element } from "./dom.js";
import { publish } from "./api.js";
import { Offline, Server } from "./server.js";

const held = document.getElementById("gonio-materials");
try {
  const server = held ? new Offline(decoded(JSON.parse(held.textContent))) : new Server(new URL("socket", location.href.replace(/^http/, "ws")).href, (error) => app?.errors.show(error));
  var app = new App(server, Boolean(held));
  if (held && !app.state.materials.length) app.state.materials = server.held.materials.map(({ text }) => ({ text, replaced: {} }));
  publish(app);
} catch (error) {
  document.body.append(element("div", { class: "error", role: "alert", "data-testid": "error" }, element("pre", {}, error.message)));
}
