import {
  BufferAttribute, BufferGeometry, ConeGeometry, CylinderGeometry, GLSL3, Group, LineSegments, Mesh, NoBlending, CustomBlending, OneFactor, OneMinusSrcAlphaFactor,
  RawShaderMaterial, Scene, SphereGeometry, Vector3,
} from "three";
import { HEAD } from "../gpu.js";
import { COLUMNS, LOBE_FRAGMENT, LOBE_VERTEX, PATCHES, PLAIN_FRAGMENT, PLAIN_VERTEX } from "../shaders/lobe.js";

/** What stands around lobes: the tangent plane with its angles, the normal, the incident and the mirror direction. */
export class LobeScene {
  constructor() {
    this.scene = new Scene();
    this.grid = plain();
    this.strong = plain();
    this.accent = plain();
    this.scene.add(lines(floor(), this.grid), lines([[0, 0, 0], [0, 0, 1.16]], this.strong), lines([[0, 0, 0], [1.1, 0, 0]], this.strong));
    this.incident = arrow(this.accent);
    this.mirror = lines(dashes(), this.strong);
    this.scene.add(this.incident, this.mirror);
    this.below = lines(circle(1, "xz").concat(circle(1, "yz")), this.grid);
    this.scene.add(this.below);
    this.lobes = new Map();
    this.shapes = [false, true].map(lobeGeometry);
  }

  place(wi) {
    const up = new Vector3(0, 1, 0);
    this.incident.quaternion.setFromUnitVectors(up, new Vector3(...wi));
    this.mirror.quaternion.setFromUnitVectors(up, new Vector3(-wi[0], -wi[1], wi[2]));
  }

  /** The two meshes of a lobe: depth first, then colour, so that only its nearest surface shows through others. */
  add(material, uniforms) {
    const shape = this.shapes[material.twoSided ? 1 : 0];
    const depth = new Mesh(shape, lobeMaterial(uniforms, { colorWrite: false }));
    const colour = new Mesh(shape, lobeMaterial(uniforms, { depthWrite: false }));
    [depth, colour].forEach((mesh, k) => {
      mesh.frustumCulled = false;
      mesh.renderOrder = 10 + 2 * material.index + k;
    });
    const group = new Group();
    group.add(depth, colour);
    group.opaque = (is) => {
      depth.visible = !is;
      colour.material.depthWrite = is;
    };
    this.scene.add(group);
    this.lobes.set(material, group);
  }

  clear() {
    for (const group of this.lobes.values()) {
      group.children.forEach((mesh) => mesh.material.dispose());
      this.scene.remove(group);
    }
    this.lobes.clear();
  }
}

function lobeMaterial(uniforms, options) {
  return new RawShaderMaterial({
    glslVersion: GLSL3, vertexShader: HEAD + LOBE_VERTEX, fragmentShader: HEAD + LOBE_FRAGMENT, uniforms, side: 2, transparent: true, forceSinglePass: true,
    blending: CustomBlending, blendSrc: OneFactor, blendDst: OneMinusSrcAlphaFactor, ...options,
  });
}

function lobeGeometry(twoSided) {
  const [places, indices] = [[], []];
  for (const { first, rows } of PATCHES.slice(0, twoSided ? 4 : 3)) {
    const start = places.length / 3;
    for (let row = 0; row < rows; row++) for (let column = 0; column < COLUMNS; column++) places.push(column, first + row, 0);
    for (let row = 0; row < rows - 1; row++) for (let column = 0; column < COLUMNS - 1; column++) {
      const a = start + row * COLUMNS + column;
      indices.push(a, a + 1, a + COLUMNS, a + 1, a + COLUMNS + 1, a + COLUMNS);
    }
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(places), 3));
  geometry.setIndex(indices);
  return geometry;
}

function plain() {
  return new RawShaderMaterial({
    glslVersion: GLSL3, vertexShader: HEAD + PLAIN_VERTEX, fragmentShader: HEAD + PLAIN_FRAGMENT, uniforms: { page_tint: { value: [0, 0, 0, 1] } }, blending: NoBlending,
  });
}

function lines(points, material) {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(points.flat()), 3));
  const made = new LineSegments(geometry, material);
  made.frustumCulled = false;
  return made;
}

function circle(radius, plane = "xy") {
  const points = [];
  for (let k = 0; k < 96; k++) for (const j of [k, k + 1]) {
    const [c, s] = [radius * Math.cos((j * Math.PI) / 48), radius * Math.sin((j * Math.PI) / 48)];
    points.push(plane === "xy" ? [c, s, 0] : plane === "xz" ? [c, 0, s] : [0, c, s]);
  }
  return points;
}

function floor() {
  const points = [0.25, 0.5, 0.75, 1].flatMap((radius) => circle(radius));
  for (let k = 0; k < 12; k++) {
    const a = (k * Math.PI) / 6;
    points.push([0, 0, 0], [Math.cos(a), Math.sin(a), 0]);
  }
  return points;
}

function dashes() {
  return Array.from({ length: 12 }, (_, k) => [[0, (k * 1.15) / 12, 0], [0, ((k + 0.5) * 1.15) / 12, 0]]).flat();
}

/** An arrow along y that points at the origin, with a ball to take it by. */
function arrow(material) {
  const group = new Group();
  const shaft = new Mesh(new CylinderGeometry(0.011, 0.011, 1.0, 10), material);
  shaft.position.y = 0.68;
  const tip = new Mesh(new ConeGeometry(0.04, 0.13, 20), material);
  tip.rotation.x = Math.PI;
  tip.position.y = 0.12;
  const ball = new Mesh(new SphereGeometry(0.052, 20, 14), material);
  ball.position.y = 1.2;
  group.add(shaft, tip, ball);
  group.traverse((one) => (one.frustumCulled = false));
  return group;
}
