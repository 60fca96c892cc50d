import { button, download, element } from "../dom.js";

/** A panel of the page. What is drawn there is drawn in the next frame after `changed`, if it is in sight. */
export class View {
  static needs = () => true; // whether a material has something to show here

  constructor(app) {
    this.app = app;
    this.dirty = true;
    this.inSight = true;
    this.body = element("div", { class: "body" });
    this.bar = element("div", { class: "controls" });
    this.element = element(
      "section",
      { class: `panel ${this.constructor.key}`, "aria-label": this.constructor.title, "data-view": this.constructor.key },
      element(
        "header",
        {},
        element("h2", {}, this.constructor.title),
        this.bar,
        element(
          "div",
          { class: "tools" },
          this.csv ? button("CSV", () => this.save("csv"), { title: "Save the numbers of this view", "aria-label": `Save the numbers of ${this.constructor.title} as CSV` }) : null,
          this.picture ? button("PNG", () => this.save("png"), { title: "Save the picture of this view", "aria-label": `Save the picture of ${this.constructor.title}` }) : null,
          button("⤢", () => app.alone(this.constructor.key), { title: "This view alone, or all again", "aria-label": `${this.constructor.title} alone` }),
        ),
      ),
      this.body,
    );
    new IntersectionObserver(([entry]) => {
      this.inSight = entry.isIntersecting;
      if (this.inSight && this.dirty) app.redraw();
    }).observe(this.element);
    new ResizeObserver(() => this.changed("size")).observe(this.body);
  }

  get shown() {
    return this.element.isConnected && this.inSight;
  }

  /** `kind`: materials, values, incidence, channel, view, camera, theme, units, size. */
  changed() {
    this.dirty = true;
    this.app.redraw();
  }

  async save(kind) {
    const name = `gonio-${this.constructor.key}`;
    if (kind === "csv") download(`${name}.csv`, this.csv(), "text/csv");
    else (await this.picture()).toBlob((blob) => download(`${name}.png`, blob));
  }
}

/** Several canvases beside each other as one picture on the page's background. */
export function joined(canvases) {
  const width = canvases.reduce((sum, one) => sum + one.width, 0);
  const made = element("canvas", { width, height: Math.max(...canvases.map((one) => one.height)) });
  const drawing = made.getContext("2d");
  drawing.fillStyle = getComputedStyle(document.documentElement).getPropertyValue("--panel");
  drawing.fillRect(0, 0, made.width, made.height);
  let x = 0;
  for (const one of canvases) {
    drawing.drawImage(one, x, 0);
    x += one.width;
  }
  return made;
}

/** A view with a cell for each material; a change of one material draws one cell. */
export class CellView extends View {
  constructor(app) {
    super(app);
    this.cells = [];
    this.body.classList.add("cells");
    this.stale = new Set();
  }

  picture() {
    return joined(this.cells.filter((cell) => cell.canvas).map((cell) => this.pictureOf(cell)));
  }

  pictureOf(cell) {
    return cell.canvas;
  }

  shownMaterials() {
    return this.app.materials;
  }

  changed(kind, material) {
    if (kind === "materials") this.build();
    for (const cell of this.cells) if (!material || cell.material === material) this.stale.add(cell);
    super.changed();
  }

  build() {
    for (const cell of this.cells) this.drop?.(cell);
    this.stale.clear();
    this.cells = this.shownMaterials().map((material) => {
      if (!material.glsl) return { material, element: refusal(material, `${this.constructor.key}-${material.index}`) };
      const canvas = element("canvas", { tabindex: 0, role: "img", "data-testid": `${this.constructor.testid}-${material.index}`, "aria-label": `${this.constructor.title} of ${material.title}` });
      const caption = element("figcaption", {}, element("i", { style: `background:${material.colour}` }), element("span", { title: material.title }, this.caption(material)), element("output", {}));
      const cell = { material, canvas, caption, note: caption.querySelector("output"), element: element("figure", {}, element("div", { class: "picture" }, canvas), caption) };
      this.prepare?.(cell);
      return cell;
    });
    this.body.replaceChildren(...this.cells.map((cell) => cell.element));
  }

  caption(material) {
    return material.title;
  }

  /** Sets the canvas to the pixels it has on the screen; false if there are none. */
  fit(cell, square = false) {
    const box = cell.canvas.parentElement;
    const ratio = Math.min(devicePixelRatio, 2);
    let [width, height] = [box.clientWidth, box.clientHeight];
    if (square) width = height = Math.min(width, height);
    const pixels = [width, height].map((size) => Math.max(1, Math.min(1600, Math.round(size * ratio))));
    if (width < 2 || height < 2) return false;
    if (cell.canvas.width !== pixels[0] || cell.canvas.height !== pixels[1]) [cell.canvas.width, cell.canvas.height] = pixels;
    cell.canvas.style.width = `${width}px`;
    cell.canvas.style.height = `${height}px`;
    return true;
  }

  /** Draws stale cells; `draw(cell)` says whether the cell wants another frame. */
  draw() {
    const cells = [...this.stale].filter((cell) => cell.canvas);
    this.stale.clear();
    for (const cell of cells) if (this.drawCell(cell)) this.stale.add(cell);
    return this.stale.size > 0;
  }
}

export function refusal(material, testid) {
  return element("div", { class: "refusal", "data-testid": testid }, element("b", {}, material.title), element("p", {}, `There is no picture: ${material.why ?? "this material has no shader source"}`));
}
