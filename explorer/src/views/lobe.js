import { PerspectiveCamera, Raycaster, Vector2, Vector3, WebGLRenderTarget } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { element, labelled, select } from "../dom.js";
import { angles, direction, mirror } from "../directions.js";
import { floats, Pass } from "../gpu.js";
import { angleText, written } from "../numbers.js";
import { passOf } from "../passes.js";
import { COLUMN_MAXIMUM, COLUMNS, COPY, FIELD, lobeRows, MAXIMUM, SHAPE } from "../shaders/lobe.js";
import { CellView } from "./view.js";
import { LobeScene } from "./lobe-scene.js";

const MOST = 32; // materials in the texture of maxima
const HANDLE = 1.2;
const SAMPLES = 4; // a pixel, when nothing moves

/** f at one incidence as a surface: the radius in a direction is f, or its logarithm or cube root. */
export class Lobe extends CellView {
  static key = "lobe";
  static title = "Lobe";
  static testid = "lobe";

  constructor(app) {
    super(app);
    const { lobe } = app.state;
    const choice = (key, options, label) =>
      labelled(label, select(options, lobe[key], (value) => { lobe[key] = value; app.change(key === "layout" ? "materials" : "view", null, this); }, { "data-testid": `lobe-${key}` }));
    this.several = [choice("size", [["common", "common"], ["own", "each its own"]], "scale"), choice("layout", [["together", "overlaid"], ["side", "side by side"]], "lobes")];
    this.bar.append(
      choice("radius", [["linear", "linear"], ["log", "log, 4 decades"], ["root", "cube root"]], "radius"),
      ...this.several,
    );
    this.camera = new PerspectiveCamera(30, 1, 0.1, 50);
    this.camera.up.set(0, 0, 1);
    this.fields = new Map(); // material -> {target, columns, uniforms}
    this.maxima = floats(MOST, 1);
    this.old = new Set();
  }

  shownMaterials() {
    const drawable = this.app.materials.filter((one) => one.glsl);
    return this.app.state.lobe.layout === "together" && drawable.length ? drawable.slice(0, 1) : this.app.materials;
  }

  caption(material) {
    const drawn = this.app.materials.filter((one) => one.glsl).length;
    return this.app.state.lobe.layout === "together" && drawn > 1 ? `${drawn} materials` : material.title;
  }

  changed(kind, material) {
    if (kind === "materials") {
      this.forget();
      for (const control of this.several) control.hidden = this.app.materials.length < 2;
    }
    if (["materials", "values", "incidence", "channel"].includes(kind)) for (const one of material ? [material] : this.app.materials) this.old.add(one);
    for (const cell of this.cells) cell.coarse = false;
    super.changed(kind, kind === "values" ? null : material);
  }

  forget() {
    for (const { target, columns, shape } of this.fields.values()) [target, columns, shape].forEach((one) => one.dispose());
    this.fields.clear();
    this.surroundings?.clear();
    this.compiled = null;
  }

  prepare(cell) {
    const { canvas } = cell;
    canvas.classList.add("grab");
    cell.labels = element("div", { class: "labels", "aria-hidden": "true" });
    canvas.after(cell.labels);
    canvas.setAttribute("aria-description", "Drag the ball to move the light, drag elsewhere to turn the view. Arrow keys move the light, with Shift they turn the view.");
    canvas.addEventListener("pointerdown", (event) => this.take(cell, event), { capture: true });
    canvas.addEventListener("touchstart", (event) => this.atHandle(cell, event.touches[0]) && event.preventDefault(), { passive: false });
    canvas.addEventListener("keydown", (event) => this.key(event));
    this.camera.position.set(...this.app.state.camera);
    const controls = new OrbitControls(this.camera, canvas);
    controls.enablePan = false;
    controls.minDistance = 1.8;
    controls.maxDistance = 9;
    controls.target.set(0, 0, 0.42);
    controls.update();
    controls.addEventListener("change", () => this.moved());
    canvas.style.touchAction = "pan-y";
    cell.controls = controls;
  }

  drop(cell) {
    cell.controls?.dispose();
  }

  moved() {
    this.app.state.camera = this.camera.position.toArray().map((x) => Number(x.toFixed(3)));
    this.app.change("camera", null, this);
  }

  key(event) {
    const way = { ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [-1, 0], ArrowDown: [1, 0] }[event.key];
    if (!way) return;
    event.preventDefault();
    if (event.shiftKey) {
      const offset = this.camera.position.clone().sub(new Vector3(0, 0, 0.42));
      offset.applyAxisAngle(new Vector3(0, 0, 1), way[1] * 0.1);
      offset.applyAxisAngle(new Vector3(0, 0, 1).cross(offset).normalize(), way[0] * 0.06);
      this.camera.position.copy(offset.add(new Vector3(0, 0, 0.42)));
      return this.moved();
    }
    const { theta, phi } = this.app.state;
    this.app.setIncidence(Math.min(89.5, Math.max(0, theta + way[0])), phi + way[1]);
  }

  handle(cell) {
    const box = cell.canvas.getBoundingClientRect();
    this.aim(box.width / box.height);
    const { theta, phi } = this.app.state;
    const at = new Vector3(...direction(theta, phi)).multiplyScalar(HANDLE).project(this.camera);
    return [box.left + ((at.x + 1) / 2) * box.width, box.top + ((1 - at.y) / 2) * box.height];
  }

  atHandle(cell, { clientX, clientY }) {
    const [x, y] = this.handle(cell);
    return Math.hypot(clientX - x, clientY - y) < 20;
  }

  take(cell, event) {
    if (event.button !== 0 || !this.atHandle(cell, event)) return;
    event.stopImmediatePropagation();
    event.preventDefault();
    cell.canvas.focus();
    cell.canvas.setPointerCapture(event.pointerId);
    const move = ({ clientX, clientY }) => this.drag(cell, clientX, clientY);
    cell.canvas.addEventListener("pointermove", move);
    cell.canvas.addEventListener("lostpointercapture", () => cell.canvas.removeEventListener("pointermove", move), { once: true });
  }

  /** Moves the light to where the pointer's ray meets the sphere of the handle, or comes nearest to it. */
  drag(cell, clientX, clientY) {
    const box = cell.canvas.getBoundingClientRect();
    const caster = new Raycaster();
    caster.setFromCamera(new Vector2((2 * (clientX - box.left)) / box.width - 1, 1 - (2 * (clientY - box.top)) / box.height), this.camera);
    const { origin, direction: ray } = caster.ray;
    const along = origin.dot(ray);
    const inside = along * along - origin.lengthSq() + HANDLE * HANDLE;
    const at = origin.clone().addScaledVector(ray, -along - Math.sqrt(Math.max(0, inside)));
    if (at.z < 0 && inside > 0) at.copy(origin).addScaledVector(ray, -along + Math.sqrt(inside));
    at.z = Math.max(at.z, 0.01);
    const [theta, phi] = angles(at.normalize().toArray());
    this.app.setIncidence(Math.min(89.5, Number(theta.toFixed(1))), theta < 0.5 ? this.app.state.phi : Number(phi.toFixed(1)));
  }

  aim(aspect) {
    const { camera } = this;
    camera.position.set(...this.app.state.camera);
    camera.aspect = aspect;
    const whole = this.app.materials.some((one) => one.twoSided);
    const narrow = Math.min(1, aspect / 1.15) / (whole ? 1.2 : 1);
    camera.fov = (2 * Math.atan(Math.tan((15 * Math.PI) / 180) / narrow) * 180) / Math.PI;
    camera.lookAt(0, 0, whole ? 0.06 : 0.42);
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
  }

  draw() {
    return this.bringFields() || super.draw();
  }

  /** Brings old fields up to date; true while some program is being compiled. */
  bringFields() {
    const { app } = this;
    const { gpu } = app;
    this.columnPass ??= new Pass(gpu, COLUMN_MAXIMUM, { page_field: { value: null } }, () => app.redraw());
    this.maximumPass ??= new Pass(gpu, MAXIMUM, { page_columns: { value: null } }, () => app.redraw());
    this.surroundings ??= new LobeScene();
    const between = ["field", "maxima", "from", "to", "radius"].map((name) => [`page_${name}`, { value: null }]);
    this.shapePass ??= new Pass(gpu, SHAPE, Object.fromEntries(between), () => app.redraw());
    if (!this.columnPass.ready() | !this.maximumPass.ready() | !this.shapePass.ready()) return true;
    let waiting = false;
    for (const material of this.old) {
      if (!material.glsl || !app.materials.includes(material)) {
        this.old.delete(material);
        continue;
      }
      const pass = passOf(app, material, "field", () => FIELD, () => ({ page_incident: { value: [0, 0, 1] } }));
      if (!pass) {
        waiting = true;
        continue;
      }
      this.old.delete(material);
      this.bringField(material, pass);
    }
    if (!waiting) this.readMaxima();
    return waiting;
  }

  bringField(material, pass) {
    const rows = lobeRows(material.twoSided);
    if (!this.fields.has(material)) {
      const field = { target: floats(COLUMNS, rows), columns: floats(COLUMNS, 1), shape: floats(COLUMNS, rows, { count: 2 }) };
      const [places, normals] = field.shape.textures;
      field.uniforms = {
        page_field: { value: field.target.texture }, page_places: { value: places }, page_normals: { value: normals },
        page_tint: { value: [0, 0, 0] }, page_alpha: { value: 1 }, page_ink: { value: [0, 0, 0] },
      };
      this.fields.set(material, field);
      this.surroundings.add(material, field.uniforms);
    }
    const { target, columns } = this.fields.get(material);
    const { theta, phi } = this.app.state;
    pass.uniforms.page_incident.value = direction(theta, phi);
    pass.draw(target);
    this.columnPass.uniforms.page_field.value = target.texture;
    this.columnPass.draw(columns);
    this.maximumPass.uniforms.page_columns.value = columns.texture;
    this.maxima.viewport.set(material.index % MOST, 0, 1, 1);
    this.maximumPass.draw(this.maxima);
  }

  async readMaxima() {
    if (this.reading) return;
    this.reading = true;
    const values = await this.app.gpu.read(this.maxima, MOST, 1);
    this.reading = false;
    const { lobe, units, theta } = this.app.state;
    const of = ({ index }) => values[4 * (index % MOST)];
    const drawn = this.app.materials.filter((one) => one.glsl);
    for (const cell of this.cells.filter((one) => one.canvas)) {
      const among = lobe.size === "common" ? drawn : [cell.material];
      const largest = Math.max(...among.map(of));
      const own = lobe.size === "own" && lobe.layout === "together" && drawn.length > 1;
      cell.note.textContent = `θᵢ ${angleText(theta, units, 3)}, radius 1: ${own ? "each material's largest f" : `f = ${written(largest, 4)} sr⁻¹`}`;
    }
  }

  drawCell(cell) {
    if (!this.fit(cell) || !this.fields.size) return false;
    const { app, surroundings } = this;
    const { width, height } = cell.canvas;
    const { lobe, theta, phi } = app.state;
    const together = lobe.layout === "together";
    const wi = direction(theta, phi);
    this.aim(width / height);
    surroundings.place(wi);
    surroundings.below.visible = app.materials.some((one) => one.twoSided);
    const { ink, grid, accent, dark } = app.theme.colours();
    surroundings.strong.uniforms.page_tint.value = [...ink, 0.75];
    surroundings.grid.uniforms.page_tint.value = [...grid, 1];
    surroundings.accent.uniforms.page_tint.value = [...accent, 1];
    const drawn = app.materials.filter((one) => this.fields.has(one));
    for (const [material, field] of this.fields) {
      const { uniforms } = field;
      this.shape(material, field);
      uniforms.page_tint.value = app.theme.rgb(material.colour, dark ? 1.12 : 1);
      uniforms.page_alpha.value = together && drawn.length > 1 ? 0.62 : 1;
      uniforms.page_ink.value = dark ? [1, 1, 1] : [0, 0, 0];
      surroundings.lobes.get(material).visible = together || material === cell.material;
    }
    for (const group of surroundings.lobes.values()) group.opaque(!together || drawn.length === 1);
    if (!this.compile()) return true;
    this.render(cell, width, height, cell.coarse);
    this.label(cell, wi);
    cell.coarse = !cell.coarse;
    return cell.coarse;
  }

  /** Whether all that is left to do is smoothing of edges. */
  get refining() {
    return !this.old.size && this.stale.size > 0 && [...this.stale].every((cell) => cell.coarse);
  }

  /** Makes f a radius, as the page shows it now. */
  shape({ index }, { target, shape }) {
    const { lobe } = this.app.state;
    const own = lobe.size === "own";
    const { uniforms } = this.shapePass;
    uniforms.page_field.value = target.texture;
    uniforms.page_maxima.value = this.maxima.texture;
    uniforms.page_from.value = own ? index % MOST : 0;
    uniforms.page_to.value = own ? (index % MOST) + 1 : Math.min(MOST, this.app.materials.length);
    uniforms.page_radius.value = ["linear", "log", "root"].indexOf(lobe.radius);
    this.shapePass.draw(shape);
  }

  compile() {
    if (!this.compiled) {
      const { gpu } = this.app;
      this.compiled = { done: false };
      const { compiled } = this;
      gpu.compile(this.surroundings.scene, this.camera).then(() => {
        compiled.done = true;
        this.app.redraw();
      });
    }
    return this.compiled.done;
  }

  /** Straight to the canvas while something moves; with smooth edges by way of a target. */
  render(cell, width, height, isSmooth) {
    const { gpu } = this.app;
    if (isSmooth && (this.target?.width !== width || this.target?.height !== height)) {
      this.target?.dispose();
      this.target = new WebGLRenderTarget(width, height, { samples: SAMPLES, depthBuffer: true });
    }
    gpu.aim(isSmooth ? this.target : null, width, height);
    gpu.renderer.setClearColor(0, 0);
    gpu.renderer.clear();
    gpu.renderer.render(this.surroundings.scene, this.camera);
    if (isSmooth) {
      this.copy ??= new Pass(gpu, COPY, { page_picture: { value: null } }, () => {});
      this.copy.uniforms.page_picture.value = this.target.texture;
      this.copy.draw(null, width, height);
    }
    gpu.show(cell.canvas);
  }

  /** Names beside what is drawn: `cell.names` holds them with their places, as shares of the picture. */
  label(cell, wi) {
    const at = (text, place, kind) => {
      const { x, y } = new Vector3(...place).project(this.camera);
      return { text, kind, x: (x + 1) / 2, y: (1 - y) / 2 };
    };
    cell.names = [
      at("n", [0, 0, 1.24], "plain"), at("x", [1.17, 0, 0], "plain"), at("mirror", mirror(wi).map((x) => 1.24 * x), "plain"), at("ωᵢ", wi.map((x) => 1.34 * x), "light"),
    ];
    const key = JSON.stringify(cell.names);
    if (key === cell.named) return;
    cell.named = key;
    cell.labels.replaceChildren(...cell.names.map(({ text, kind, x, y }) => element("span", { class: kind, style: `left:${(100 * x).toFixed(2)}%;top:${(100 * y).toFixed(2)}%` }, text)));
  }

  pictureOf(cell) {
    const { width, height } = cell.canvas;
    const copy = element("canvas", { width, height });
    const drawing = copy.getContext("2d");
    drawing.drawImage(cell.canvas, 0, 0);
    drawing.font = `italic ${Math.round((13 * width) / cell.canvas.clientWidth)}px Georgia, "Times New Roman", serif`;
    drawing.textAlign = "center";
    drawing.textBaseline = "middle";
    const style = getComputedStyle(document.documentElement);
    for (const { text, kind, x, y } of cell.names ?? []) {
      drawing.fillStyle = style.getPropertyValue(kind === "light" ? "--light" : "--ink");
      drawing.fillText(text, x * width, y * height);
    }
    return copy;
  }
}
