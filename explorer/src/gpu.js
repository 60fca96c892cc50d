import {
  BufferAttribute, BufferGeometry, Camera, DataTexture, FloatType, GLSL3, Mesh, NearestFilter, NoBlending, OneFactor, RawShaderMaterial,
  RedFormat, RGBAFormat, Scene, WebGLRenderer, WebGLRenderTarget,
} from "three";

export const HEAD = "precision highp float;\nprecision highp int;\nprecision highp sampler2D;\n";
const WHOLE = "in vec3 position;\nvoid main() { gl_Position = vec4(position.xy, 0.0, 1.0); }\n";

/** One WebGL context for all views: each is drawn here, then handed to the canvas in its cell. */
export class Gpu {
  constructor() {
    this.canvas = new OffscreenCanvas(512, 512);
    this.renderer = new WebGLRenderer({ canvas: this.canvas, alpha: true, antialias: false, stencil: false });
    this.renderer.autoClear = false;
    this.renderer.debug.checkShaderErrors = false; // it waits for each program; `compile` looks when they are done
    this.renderer.setPixelRatio(1);
    this.renderer.setSize(512, 512, false);
    if (!this.renderer.extensions.has("EXT_color_buffer_float")) {
      throw new Error("This browser draws no float textures (EXT_color_buffer_float): use another browser, or gonio report.");
    }
    this.camera = new Camera();
    const triangle = new BufferGeometry();
    triangle.setAttribute("position", new BufferAttribute(new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]), 3));
    this.triangle = triangle;
  }

  /** The target that the next drawing goes to; null is the canvas, which takes the size of the picture. */
  aim(target, width, height) {
    this.renderer.setRenderTarget(target);
    if (target !== null) return;
    if (width !== this.canvas.width || height !== this.canvas.height) this.renderer.setSize(width, height, false);
  }

  /** Hands the picture to a canvas, which stretches it to its own size. */
  show(canvas) {
    canvas.getContext("bitmaprenderer").transferFromImageBitmap(this.canvas.transferToImageBitmap());
  }

  /** Compiles what a scene needs, beside the page's own work where the browser can. */
  async compile(scene, camera) {
    const { renderer } = this;
    if (renderer.extensions.has("KHR_parallel_shader_compile")) await renderer.compileAsync(scene, camera);
    else {
      renderer.compile(scene, camera);
      await new Promise((resolve) => setTimeout(resolve)); // others start meanwhile: to ask for one is to wait for it
    }
    const gl = renderer.getContext();
    scene.traverse(({ material }) => {
      const program = material && renderer.properties.get(material).currentProgram?.program;
      if (!program || gl.getProgramParameter(program, gl.LINK_STATUS) || gl.isContextLost()) return;
      throw new Error(`This browser does not compile the source of a material: ${gl.getProgramInfoLog(program)}`);
    });
  }

  async read(target, width, height) {
    const values = new Float32Array(4 * width * height);
    await this.renderer.readRenderTargetPixelsAsync(target, 0, 0, width, height, values);
    return values;
  }

  /** Fulfilled when everything asked of the GPU so far is done. */
  async finished() {
    const gl = this.renderer.getContext();
    const sync = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
    while (gl.clientWaitSync(sync, 0, 0) === gl.TIMEOUT_EXPIRED) await new Promise((resolve) => setTimeout(resolve, 1));
    gl.deleteSync(sync);
  }
}

/** A target of float32 numbers, four a pixel. */
export function floats(width, height, options = {}) {
  return new WebGLRenderTarget(width, height, {
    type: FloatType, format: RGBAFormat, minFilter: NearestFilter, magFilter: NearestFilter, depthBuffer: false, ...options,
  });
}

/** A texture of float32 numbers, four a pixel. */
export function directionTexture(data, width, height) {
  const texture = new DataTexture(data, width, height, RGBAFormat, FloatType);
  texture.needsUpdate = true;
  return texture;
}

const TABLE_WIDTH = 2048;

/** A table of gonio's source: entry i stands at (i % 2048, i / 2048). */
export function tableTexture(values) {
  const height = Math.max(1, Math.ceil(values.length / TABLE_WIDTH));
  let data = values;
  if (values.length !== TABLE_WIDTH * height) {
    data = new Float32Array(TABLE_WIDTH * height);
    data.set(values);
  }
  const texture = new DataTexture(data, TABLE_WIDTH, height, RedFormat, FloatType);
  texture.needsUpdate = true;
  return texture;
}

/** A program that is compiled when first asked for; `ready` says whether it can draw yet. */
export class Program {
  constructor(gpu, object, done) {
    this.gpu = gpu;
    this.scene = new Scene();
    this.scene.add(object);
    object.frustumCulled = false;
    this.object = object;
    this.done = done;
    this.compiled = false;
    this.asked = false;
  }

  ready() {
    if (!this.asked) {
      this.asked = true;
      this.gpu.compile(this.scene, this.gpu.camera).then(
        () => {
          this.compiled = true;
          this.done();
        },
        (error) => {
          this.failed = error;
          this.done();
        },
      );
    }
    if (this.failed) throw this.failed;
    return this.compiled;
  }

  dispose() {
    this.object.material.dispose();
  }
}

/** A fragment shader on every pixel of a target. */
export class Pass extends Program {
  constructor(gpu, fragment, uniforms, done) {
    const material = new RawShaderMaterial({
      glslVersion: GLSL3, vertexShader: HEAD + WHOLE, fragmentShader: HEAD + fragment, uniforms, depthTest: false, depthWrite: false, blending: NoBlending,
      blendSrc: OneFactor, blendDst: OneFactor,
    });
    super(gpu, new Mesh(gpu.triangle, material), done);
    this.uniforms = uniforms;
  }

  draw(target, width, height) {
    this.gpu.aim(target, width, height);
    this.gpu.renderer.render(this.scene, this.gpu.camera);
  }
}
