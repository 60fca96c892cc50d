import {
  BufferGeometry, CustomBlending, FloatType, GLSL3, HalfFloatType, Mesh, NearestFilter, NoBlending, PerspectiveCamera, RawShaderMaterial, RGBAFormat, TorusKnotGeometry, WebGLRenderTarget,
} from "three";
import { TeapotGeometry } from "three/addons/geometries/TeapotGeometry.js";
import { select } from "../dom.js";
import { DEGREE } from "../directions.js";
import { floats, HEAD, Pass, Program } from "../gpu.js";
import { passOf } from "../passes.js";
import { lit, MESH_FRAGMENT, MESH_VERTEX, TONE } from "../shaders/lit.js";
import { rangeControl } from "../ui/range.js";
import { CellView } from "./view.js";

const STEPS = { point: 8, area: 96, environment: 128 };
const COARSE = { point: 1, area: 2, environment: 2 }; // pixels of the screen along one of the first picture
const DISTANCE = 5;
const ZOOM = 0.222; // tangent of half the field of view: the unit sphere with a margin

/** A sphere or mesh under a light; area and environment light gather a sample per pixel and frame. */
export class Lit extends CellView {
  static key = "lit";
  static title = "Lit shape";
  static testid = "sphere";

  constructor(app) {
    super(app);
    const { state } = app;
    this.camera = new PerspectiveCamera(20, 1, 1, 20);
    this.bar.append(
      select(["point", "area", "environment"].map((one) => [one, one]), state.light, (value) => this.choose("light", value), { "data-testid": "light", "aria-label": "Light" }),
      select([["sphere", "sphere"], ["teapot", "teapot"], ["knot", "knot"]], state.shape, (value) => this.choose("shape", value), { "data-testid": "shape", "aria-label": "Shape" }),
      rangeControl({ label: "EV", name: "exposure", title: "exposure", low: -8, high: 8, step: 0.25, value: state.exposure, change: (value) => this.choose("exposure", value) }),
    );
  }

  /** Whether everything is there, and only gets better. */
  get refining() {
    return this.stale.size > 0 && [...this.stale].every((cell) => cell.step >= 0);
  }

  choose(key, value) {
    this.app.state[key] = value;
    this.app.change(key === "exposure" ? "exposure" : "view", null, this);
  }

  changed(kind, material) {
    if (!["incidence", "channel", "units", "exposure"].includes(kind)) {
      for (const cell of this.cells) if (!material || cell.material === material) cell.step = -1;
    }
    if (["incidence", "channel", "units"].includes(kind)) return;
    super.changed(kind, material);
  }

  prepare(cell) {
    cell.step = -1;
    cell.canvas.setAttribute("aria-description", "Drag, or press arrow keys, to move the light; with Shift to turn the shape.");
    cell.canvas.addEventListener("pointerdown", (event) => {
      if (event.button > 0) return;
      cell.canvas.setPointerCapture(event.pointerId);
      const move = (moved) => this.turn(moved.movementX * 0.5, -moved.movementY * 0.5, moved.shiftKey);
      cell.canvas.addEventListener("pointermove", move);
      cell.canvas.addEventListener("lostpointercapture", () => cell.canvas.removeEventListener("pointermove", move), { once: true });
    });
    cell.canvas.addEventListener("keydown", (event) => {
      const way = { ArrowLeft: [-5, 0], ArrowRight: [5, 0], ArrowUp: [0, 5], ArrowDown: [0, -5] }[event.key];
      if (!way) return;
      event.preventDefault();
      this.turn(...way, event.shiftKey);
    });
  }

  turn(right, up, shape) {
    const { state } = this.app;
    if (shape) state.turn = (((state.turn + right) % 360) + 360) % 360;
    else state.lamp = [((state.lamp[0] + right + 540) % 360) - 180, Math.min(89, Math.max(-89, state.lamp[1] + up))];
    this.app.change("view", null, this);
  }

  drop(cell) {
    cell.sum?.dispose();
  }

  /** First pictures come before better ones of other cells. */
  draw() {
    const isFirst = (cell) => cell.step < 0;
    const waiting = [...this.stale].some(isFirst) ? [...this.stale].filter((cell) => !isFirst(cell)) : [];
    for (const cell of waiting) this.stale.delete(cell);
    super.draw();
    for (const cell of waiting) this.stale.add(cell);
    return this.stale.size > 0;
  }

  /** The first picture of a state comes straight from one sample of each pixel; when the state rests, samples are added up. */
  drawCell(cell) {
    const { gpu, state } = this.app;
    if (!this.fit(cell)) return false;
    const { width, height } = cell.canvas;
    const { light, shape } = state;
    const isMesh = shape !== "sphere";
    const pass = passOf(this.app, cell.material, `lit ${light} ${isMesh}`, () => lit(light, cell.material.glsl.type, isMesh), () => this.uniforms());
    if (!pass) return true;
    const times = cell.step < 0 ? COARSE[light] : 1;
    const [across, down] = [Math.floor(width / times), Math.floor(height / times)];
    if (cell.step < STEPS[light]) {
      this.look(pass.uniforms, across, down, Math.max(0, cell.step));
      if (isMesh && !this.raster(pass.uniforms, across, down)) return true;
    }
    if (cell.step < 0) {
      this.sample(pass, 0, true);
      pass.draw(null, across, down);
      gpu.show(cell.canvas);
      cell.step = 0;
      return true;
    }
    this.tone ??= new Pass(gpu, TONE, { page_sum: { value: null }, page_gain: { value: 1 }, page_steps: { value: 1 } }, () => this.app.redraw());
    if (!this.tone.ready()) return true;
    if (cell.step < STEPS[light]) {
      this.sample(pass, cell.step, false);
      pass.draw(this.room(cell, width, height));
      cell.step++;
    }
    this.show(cell);
    return cell.step < STEPS[light];
  }

  sample(pass, step, direct) {
    const { material } = pass.object;
    material.blending = step === 0 ? NoBlending : CustomBlending;
    pass.uniforms.page_step.value = step;
    pass.uniforms.page_direct.value = direct;
    pass.uniforms.page_gain.value = 2 ** this.app.state.exposure;
  }

  show(cell) {
    const { uniforms } = this.tone;
    uniforms.page_sum.value = cell.sum.texture;
    uniforms.page_gain.value = 2 ** this.app.state.exposure;
    uniforms.page_steps.value = cell.step;
    this.tone.draw(null, cell.canvas.width, cell.canvas.height);
    this.app.gpu.show(cell.canvas);
  }

  /** The sum of a cell's samples; of half precision where the browser adds up no others. */
  room(cell, width, height) {
    if (cell.sum && (cell.sum.width !== width || cell.sum.height !== height)) this.drop(cell);
    if (!cell.sum || cell.sum.width !== width || cell.sum.height !== height) {
      const type = this.app.gpu.renderer.extensions.has("EXT_float_blend") ? FloatType : HalfFloatType;
      cell.sum = floats(width, height, { type });
    }
    return cell.sum;
  }

  uniforms() {
    const values = {
      normals: null, places: null, size: [1, 1], jitter: [0, 0], eye: [0, 0, 5], look: new Float32Array(9), lamp: [0, 0, 1], zoom: ZOOM, azimuth: 0, step: 0, direct: true, gain: 1,
    };
    return Object.fromEntries(Object.entries(values).map(([name, value]) => [`page_${name}`, { value }]));
  }

  look(uniforms, width, height, step) {
    const { turn, lamp } = this.app.state;
    const jitter = step === 0 ? [0, 0] : [((step * 0.7548776662) % 1) - 0.5, ((step * 0.569840291) % 1) - 0.5];
    const { camera } = this;
    const [azimuth, elevation] = [turn * DEGREE, 12 * DEGREE];
    camera.position.set(DISTANCE * Math.sin(azimuth) * Math.cos(elevation), DISTANCE * Math.sin(elevation), DISTANCE * Math.cos(azimuth) * Math.cos(elevation));
    camera.lookAt(0, 0, 0);
    camera.fov = (2 * Math.atan((ZOOM * height) / Math.min(width, height))) / DEGREE;
    camera.aspect = width / height;
    camera.setViewOffset(width, height, jitter[0], -jitter[1], width, height);
    camera.updateMatrixWorld();
    const m = camera.matrixWorld.elements;
    uniforms.page_look.value = Float32Array.of(m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]);
    uniforms.page_eye.value = camera.position.toArray();
    uniforms.page_size.value = [width, height];
    uniforms.page_jitter.value = jitter;
    const [a, e] = [(turn + lamp[0]) * DEGREE, lamp[1] * DEGREE];
    uniforms.page_lamp.value = [Math.sin(a) * Math.cos(e), Math.sin(e), Math.cos(a) * Math.cos(e)];
    uniforms.page_azimuth.value = a - 35 * DEGREE;
  }

  /** Normals and places of the mesh in two textures; false while the program is being compiled. */
  raster(uniforms, width, height) {
    const { gpu, state } = this.app;
    this.meshes ??= new Map();
    if (!this.meshes.has(state.shape)) {
      const material = new RawShaderMaterial({ glslVersion: GLSL3, vertexShader: HEAD + MESH_VERTEX, fragmentShader: HEAD + MESH_FRAGMENT, uniforms: { page_eye: { value: [0, 0, 5] } }, side: 2, blending: NoBlending });
      this.meshes.set(state.shape, new Program(gpu, new Mesh(geometryOf(state.shape), material), () => this.app.redraw()));
    }
    const program = this.meshes.get(state.shape);
    if (!program.ready()) return false;
    if (this.surface && (this.surface.width !== width || this.surface.height !== height)) {
      this.surface.dispose();
      this.surface = null;
    }
    this.surface ??= new WebGLRenderTarget(width, height, { count: 2, type: FloatType, format: RGBAFormat, minFilter: NearestFilter, magFilter: NearestFilter, depthBuffer: true });
    program.object.material.uniforms.page_eye.value = this.camera.position.toArray();
    gpu.aim(this.surface);
    gpu.renderer.setClearColor(0, 0);
    gpu.renderer.clear();
    gpu.renderer.render(program.scene, this.camera);
    [uniforms.page_normals.value, uniforms.page_places.value] = this.surface.textures;
    return true;
  }
}

/** A geometry moved and scaled into the unit sphere. */
function geometryOf(shape) {
  const geometry = shape === "teapot" ? new TeapotGeometry(1, 14) : new TorusKnotGeometry(0.62, 0.23, 220, 40);
  geometry.computeBoundingBox();
  const { min, max } = geometry.boundingBox;
  geometry.translate(-(min.x + max.x) / 2, -(min.y + max.y) / 2, -(min.z + max.z) / 2);
  const size = Math.max(max.x - min.x, max.y - min.y, max.z - min.z);
  const scale = (shape === "teapot" ? 2.7 : 2.1) / size;
  geometry.scale(scale, scale, scale);
  const bare = new BufferGeometry();
  bare.setIndex(geometry.index);
  bare.setAttribute("position", geometry.attributes.position);
  bare.setAttribute("normal", geometry.attributes.normal);
  return bare;
}
