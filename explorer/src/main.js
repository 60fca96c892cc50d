import "./explorer.css";
import { publish } from "./api.js";
import { App } from "./app.js";
import { decoded } from "./arrays.js";
import { asked } from "./asked.js";
import { element } from "./dom.js";
import { Offline, Server } from "./server.js";
import { read } from "./state.js";

const held = document.getElementById("gonio-materials");
let app = null;
publish(() => app, begin());

async function begin() {
  const state = read(location.hash);
  let closed = null;
  const lost = (error) => (app ? app.errors.show(error) : (closed = error));
  const server = held ? new Offline(decoded(JSON.parse(held.textContent))) : new Server(new URL("socket", location.href.replace(/^http/, "ws")).href, lost);
  await server.opened?.catch(() => null);
  const answers = asked(server, state);
  try {
    app = new App(server, Boolean(held), state);
  } catch (error) {
    document.body.replaceChildren(element("div", { class: "error", role: "alert", "data-testid": "error" }, element("pre", {}, error.message)));
    return;
  }
  if (closed) app.errors.show(closed);
  await app.start(answers);
}
