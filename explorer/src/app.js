import { element } from "./dom.js";
import { Albedos } from "./albedos.js";
import { Gpu } from "./gpu.js";
import { Material } from "./material.js";
import { debounced } from "./numbers.js";
import { Plane } from "./plane.js";
import { written } from "./state.js";
import { adder, receiveFiles } from "./ui/add.js";
import { card } from "./ui/card.js";
import { Errors } from "./ui/errors.js";
import { header } from "./ui/header.js";
import { shortcuts } from "./ui/help.js";
import { Theme } from "./ui/theme.js";
import { VIEWS } from "./views/index.js";

const REST = 160; // ms after a change until pictures are refined: while a slider moves, each state is drawn once
const BUDGET = 40; // ms of a frame after which the remaining views wait for the next one
const PAUSE = 30; // ms without a frame after which what is entered is drawn at once

/** The page: its state, its materials, its views, and the frames in which they are drawn. */
export class App {
  constructor(server, offline, state) {
    this.server = server;
    this.offline = offline;
    this.state = state;
    this.materials = [];
    this.frames = 0;
    this.lastUpdate = { from: 0, drawn: 0 };
    this.errors = new Errors();
    this.theme = new Theme(this.state, () => this.take(this.materials));
    this.keep = debounced(700, () => history.replaceState(null, "", written(this.state)));
    this.gpu = new Gpu();
    this.plane = new Plane(this);
    this.albedos = new Albedos(this);
    this.views = VIEWS.map((View) => new View(this));
    this.build();
  }

  build() {
    this.header = header(this);
    this.adder = adder(this);
    this.cards = element("div", { class: "cards" });
    this.status = element("p", { class: "status", role: "status" });
    this.grid = element("main", { class: "grid", "aria-label": "Views of the materials" });
    document.querySelector("body > .starting")?.remove();
    document.body.append(this.header, this.errors.element, element("aside", { "aria-label": "Materials" }, this.adder, this.cards, this.status), this.grid);
    receiveFiles(this);
    shortcuts(this);
    this.header.materials();
    this.arrange();
  }

  /** Shows what was asked for; see asked.js. */
  async start({ names, entries, described }) {
    const told = names.then((answer) => {
      if (answer instanceof Error) return this.errors.show(answer);
      this.adder.fill(answer);
    });
    const [kept, made] = await Promise.all([entries, described]);
    const failed = made.find((one) => one instanceof Error);
    if (failed) this.errors.show(failed);
    this.take(kept.flatMap((entry, k) => (made[k] instanceof Error ? [] : [new Material(made[k], entry, 0)])));
    if (!this.materials.length) this.say("Add a material, or drop a file.");
    await told;
    await this.idle();
  }

  async described(entry, lane) {
    try {
      return await this.server.call("material", { text: entry.text, replaced: entry.replaced }, lane);
    } catch (error) {
      this.errors.show(error);
      return null;
    }
  }

  /** The materials from now on, in this order. */
  take(materials) {
    this.materials = materials;
    materials.forEach((material, k) => (material.index = k));
    this.state.materials = materials.map(({ entry }) => entry);
    this.cards.replaceChildren(...materials.map((material) => card(this, material)));
    document.title = materials.length ? `${materials.map(({ title }) => title).join(", ").slice(0, 80)} – gonio` : "gonio";
    this.setChannel(this.state.channel);
    this.header.materials();
    this.arrange();
    this.change("materials");
  }

  async add(text) {
    const entry = { text, replaced: {} };
    this.say(`Reading ${text} …`);
    const description = await this.described(entry, `add ${text}`);
    this.say("");
    if (!description) return false;
    this.errors.hide();
    this.take([...this.materials, new Material(description, entry, 0)]);
    return true;
  }

  adopt(description) {
    this.take([...this.materials, new Material(description, { text: description.text, replaced: {} }, 0)]);
  }

  remove(material) {
    material.dispose();
    this.take(this.materials.filter((one) => one !== material));
  }

  async dropped(files) {
    for (const file of files) {
      this.say(`Reading ${file.name} …`);
      try {
        await this.add(await this.server.upload(file));
      } catch (error) {
        this.errors.show(error);
      }
    }
    this.say("");
  }

  /** Asks Python something about a material as it is now. */
  ask(call, { entry }, fields, lane) {
    return this.server.call(call, { text: entry.text, replaced: entry.replaced, ...fields }, lane);
  }

  /** Sets a number: at once where the source takes it as an argument and its slider reaches it, else by Python. */
  setParameter(index, path, value) {
    const from = performance.now();
    const material = this.materials[index];
    if (!material) throw new Error(`material ${index}: this page shows ${this.materials.length}`);
    const about = material.parameters.find((one) => one.path === path);
    const inside = !about || [value].flat().every((x) => x >= about.low && x <= about.high);
    if (!inside || !material.argument(path)) return this.setOption(material, path, value);
    material.set(path, value);
    this.input ??= from;
    this.change("values", material);
    return Promise.resolve();
  }

  async setOption(material, path, value) {
    const replaced = { ...material.entry.replaced, [path]: value };
    try {
      const description = await this.server.call("material", { text: material.entry.text, replaced }, `option ${material.index}`);
      if (!description) return;
      material.entry.replaced = replaced;
      material.take(description);
      this.errors.hide();
      this.take(this.materials);
    } catch (error) {
      this.errors.show(error);
    }
  }

  async reset(material) {
    const description = await this.described({ text: material.entry.text, replaced: {} }, `reset ${material.index}`);
    if (!description) return;
    material.entry.replaced = {};
    material.take(description);
    this.take(this.materials);
  }

  setIncidence(theta, phi = this.state.phi) {
    this.state.theta = Math.min(89.9, Math.max(0, theta));
    this.state.phi = ((phi % 360) + 360) % 360;
    this.input ??= performance.now();
    this.header.incidence();
    this.change("incidence");
  }

  move(theta, phi) {
    this.setIncidence(Math.min(89.5, this.state.theta + theta), this.state.phi + phi);
  }

  setChannel(channel) {
    const most = Math.max(1, ...this.materials.map((one) => one.components ?? 1));
    this.state.channel = Math.min(Math.max(-1, channel), most - 1);
    for (const material of this.materials) if (material.glsl) material.uniforms.page_channel.value = this.state.channel;
    this.change("channel");
  }

  setUnits(units) {
    this.state.units = units;
    this.header.units();
    this.change("units");
  }

  chooseTheme(theme) {
    this.theme.choose(theme);
    this.header.querySelector("[data-testid=theme]").value = theme;
  }

  /** A control whose value was turned by a key shows it. */
  again(testid, value) {
    const control = document.querySelector(`[data-testid=${testid}]`);
    if (control) control.value = value;
    this.change("view", null, this.views.find((view) => view.constructor.key === "lit"));
  }

  toggle(key) {
    const { views } = this.state;
    this.state.alone = null;
    this.state.views = views.includes(key) ? views.filter((one) => one !== key) : [...views, key];
    this.header.materials();
    this.arrange();
  }

  open(key) {
    if (!this.state.views.includes(key) || this.state.alone) this.toggle(key);
    if (!this.state.views.includes(key)) this.toggle(key);
    this.views.find((view) => view.constructor.key === key).element.scrollIntoView({ block: "nearest" });
  }

  alone(key) {
    this.state.alone = this.state.alone === key ? null : key;
    this.arrange();
  }

  shownViews() {
    const { views, alone } = this.state;
    const useful = ({ constructor }) => !this.materials.length || this.materials.some(constructor.needs);
    return this.views.filter((view) => (alone ? view.constructor.key === alone : views.includes(view.constructor.key)) && useful(view));
  }

  planeViews() {
    return this.views.filter(({ constructor }) => ["polar", "cartesian"].includes(constructor.key));
  }

  albedoViews() {
    return this.views.filter(({ constructor }) => ["albedo", "transmission", "spectrum"].includes(constructor.key));
  }

  arrange() {
    const shown = this.shownViews();
    this.grid.dataset.count = shown.length;
    this.grid.classList.toggle("alone", shown.length === 1);
    this.grid.replaceChildren(...(shown.length ? shown.map((view) => view.element) : [element("p", { class: "hint" }, "Choose a view above.")]));
    this.keep();
    this.redraw();
  }

  /** Tells views of a change; with `only` one of them. */
  change(kind, material = null, only = null) {
    this.changedAt = performance.now();
    for (const view of only ? [only] : this.views ?? []) view.changed(kind, material);
    this.keep();
  }

  say(text) {
    this.status.textContent = text;
  }

  /** Draws in the next frame; what is entered after a pause at once, since that frame may be far. */
  redraw() {
    if (this.asked) return;
    this.asked = true;
    if (this.input && performance.now() - (this.frameAt ?? 0) > PAUSE) queueMicrotask(() => this.frame());
    else requestAnimationFrame(() => this.frame());
  }

  /** Draws what changed; views beyond the budget of time wait for the next frame, and are first there. */
  frame() {
    this.asked = false;
    const { input } = this;
    this.input = null;
    const begin = performance.now();
    this.frameAt = begin;
    const resting = begin - (this.changedAt ?? 0) > REST;
    const due = (this.views ?? []).filter((view) => view.shown && view.dirty);
    const shown = due.filter((view) => resting || !view.refining).sort((a, b) => (a.drawnAt ?? 0) - (b.drawnAt ?? 0));
    let drawn = 0;
    for (const view of shown) {
      if (drawn && performance.now() - begin > BUDGET) break;
      view.dirty = false;
      view.drawnAt = begin;
      const isNew = !view.refining;
      try {
        if (view.draw()) view.dirty = true;
      } catch (error) {
        this.errors.show(error);
      }
      if (isNew) this.changedAt = performance.now();
      drawn++;
    }
    if (drawn) this.frames++;
    if (input) this.gpu.finished().then(() => (this.lastUpdate = { from: input, drawn: performance.now() }));
    if (due.some((view) => view.dirty && !view.refining)) this.redraw();
    else if (due.some((view) => view.dirty)) this.refine(resting);
  }

  /** Further samples: in the next frame, or when the state has been at rest for a while. */
  refine(resting) {
    clearTimeout(this.refinement);
    if (resting) this.redraw();
    else this.refinement = setTimeout(() => this.redraw(), REST);
  }

  /** Fulfilled when everything in sight has been drawn at least once. */
  async idle() {
    const pending = () => this.views.some((view) => view.shown && view.dirty && !view.refining) || this.plane.busy.size || this.albedos.busy.size;
    while (pending()) await new Promise((resolve) => setTimeout(resolve, 10));
    await this.gpu.finished();
  }
}
