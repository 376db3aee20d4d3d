// SPDX-License-Identifier: Apache-2.0
// The robot in 3D: lengths in mm, z up. The body is drawn anew with each surface that comes, at other times only when
// something changes.

import * as THREE from "./three.module.js";
import { OrbitControls } from "./OrbitControls.js";
import { Trail } from "./trail.js";
import { Handle } from "./handle.js";
import { round } from "./plot.js";

const kUp = new THREE.Vector3(0, 1, 0); // of a cylinder

export class Scene {
  // color: the value of a custom property of the page; moved(effector, mm): somebody drags a target there
  constructor(canvas, robot, color, moved) {
    this.robot = robot;
    this.color = color;
    this.canvas = canvas;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.camera = new THREE.PerspectiveCamera(32, 1, 1, 10_000);
    this.camera.up.set(0, 0, 1);
    this.scene = new THREE.Scene();
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener("change", () => this.changed());
    this.#measure();
    this.unit = this.size / 100; // what small things are sized by
    this.#light();
    this.#addBody();
    this.#addActuators();
    this.#addSurroundings();
    this.tips = robot.effectors.map((effector) => (effector.points.length ? this.#addTip() : null));
    this.handle = new Handle(this, moved);
    this.dress();
    this.observer = new ResizeObserver(() => this.changed());
    this.observer.observe(canvas);
    this.changed();
  }

  // Ends it; another robot has come.
  dispose() {
    this.observer.disconnect();
    this.controls.dispose();
    this.handle.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
    cancelAnimationFrame(this.frame);
  }

  changed() {
    this.frame ??= requestAnimationFrame(() => {
      this.frame = undefined;
      this.#draw();
    });
  }

  // Shows a surface. positions: of Connection's surface, mm
  show(positions) {
    const attribute = this.body.geometry.getAttribute("position");
    attribute.array.set(positions.subarray(0, attribute.array.length));
    attribute.needsUpdate = true;
    this.body.geometry.computeVertexNormals();
    this.positions = positions;
    this.robot.actuators.forEach((actuator, k) => this.#stretch(actuator, this.drives[k]));
    this.changed();
  }

  // efforts: by the actuators' names, N or Pa
  showEfforts(efforts) {
    this.robot.actuators.forEach((actuator, k) => {
      const color = this.#ramp(this.robot.load(actuator, efforts[actuator.name]));
      this.drives[k].material.color.copy(color);
      if (actuator.kind === "cavity")
        this.drives[k].material.opacity = 0.25 + 0.6 * this.robot.load(actuator, efforts[actuator.name]);
    });
    this.changed();
  }

  // Where an effector is wanted, modelled and measured, mm; null where that is not known.
  showTip(index, target, model, measured) {
    const tip = this.tips[index];
    for (const [which, at] of Object.entries({ target, model, measured })) {
      tip[which].visible = at !== null;
      if (!at) continue;
      tip[which].position.set(...at);
      tip.trails[which]?.add(at);
    }
    if (index === this.handle.effector) this.handle.follow(target);
    this.changed();
  }

  // Takes the page's colours, which follow the system's setting.
  dress() {
    const set = (material, name) => material.color.set(this.color(name));
    set(this.body.material, "--body");
    set(this.fixed.material, "--quiet");
    set(this.mesh.material, "--text");
    for (const line of this.lines) set(line.material, line.userData.color);
    for (const tip of this.tips.filter(Boolean)) {
      for (const which of ["target", "model", "measured"]) set(tip[which].material, `--${which}`);
      for (const which of ["model", "measured"]) tip.trails[which].dress(this.color(`--${which}`), this.color("--scene"));
    }
    for (const label of this.labels) label.material.map = this.#text(label.userData.text);
    this.handle.dress(this.color("--target"));
    this.ramp = ["--effort-0", "--effort-1", "--effort-2"].map((name) => new THREE.Color(this.color(name)));
    this.changed();
  }

  #measure() {
    const box = new THREE.Box3().setFromArray(this.robot.geometry.surface.nodes_mm.flat());
    for (const actuator of this.robot.actuators)
      for (const point of actuator.points) box.expandByPoint(new THREE.Vector3(...point.at_mm));
    this.box = box;
    const extent = box.getSize(new THREE.Vector3());
    this.size = extent.length();
    const middle = box.getCenter(new THREE.Vector3());
    this.controls.target.copy(middle);
    this.camera.position.copy(middle).addScaledVector(new THREE.Vector3(0.62, -1, 0.5).normalize(), 1.6 * this.size);
    this.camera.near = this.size / 100;
    this.camera.far = 20 * this.size;
    this.controls.minDistance = this.size / 10;
    this.controls.maxDistance = 8 * this.size;
    this.controls.update();
  }

  #light() {
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8090a0, 1.6));
    const sun = new THREE.DirectionalLight(0xffffff, 2.2);
    sun.position.set(1, -1.4, 2.2);
    this.scene.add(sun);
  }

  #addBody() {
    const { surface, fixed_mm } = this.robot.geometry;
    const positions = new THREE.BufferAttribute(new Float32Array(surface.nodes_mm.flat()), 3);
    positions.setUsage(THREE.DynamicDrawUsage);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", positions);
    geometry.setIndex(surface.faces.flat());
    geometry.computeVertexNormals();
    const material = new THREE.MeshStandardMaterial({
      roughness: 0.5, transparent: true, opacity: 0.78, side: THREE.DoubleSide,
      polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1,
    });
    this.body = new THREE.Mesh(geometry, material);
    this.body.renderOrder = 1;
    this.mesh = new THREE.Mesh(geometry,
      new THREE.MeshBasicMaterial({ wireframe: true, transparent: true, opacity: 0.09, depthWrite: false }));
    this.mesh.renderOrder = 2;
    this.fixed = new THREE.InstancedMesh(new THREE.SphereGeometry(0.42 * this.unit, 8, 6),
      new THREE.MeshStandardMaterial({ roughness: 0.8 }), fixed_mm.length);
    const place = new THREE.Matrix4();
    fixed_mm.forEach((at, k) => this.fixed.setMatrixAt(k, place.makeTranslation(...at)));
    // Its nodes move: what is seen is not decided by where they were.
    for (const part of [this.body, this.mesh, this.fixed]) part.frustumCulled = false;
    this.scene.add(this.body, this.mesh, this.fixed);
  }

  // One object an actuator, coloured by its effort: cables and rods are rows of cylinders, a push is an arrow's shaft, a
  // cavity its wall.
  #addActuators() {
    this.drives = this.robot.actuators.map((actuator) => {
      const material = new THREE.MeshStandardMaterial({ roughness: 0.4 });
      let part;
      if (actuator.kind === "cavity") {
        const geometry = new THREE.BufferGeometry();
        geometry.setAttribute("position", this.body.geometry.getAttribute("position"));
        geometry.setAttribute("normal", this.body.geometry.getAttribute("normal"));
        geometry.setIndex(actuator.faces.flat());
        Object.assign(material, { transparent: true, opacity: 0.4, side: THREE.DoubleSide, depthWrite: false });
        part = new THREE.Mesh(geometry, material);
        part.renderOrder = 3;
      } else {
        const radius = (actuator.kind === "cable" ? 0.32 : 0.7) * this.unit;
        const pieces = Math.max(1, actuator.points.length - 1);
        part = new THREE.InstancedMesh(new THREE.CylinderGeometry(radius, radius, 1, 12), material, pieces);
        const guides = new THREE.InstancedMesh(new THREE.SphereGeometry(0.85 * this.unit, 16, 12), material,
          actuator.points.length);
        part.add(guides);
        part.userData.guides = guides;
        guides.frustumCulled = false;
      }
      part.frustumCulled = false;
      part.visible = actuator.points.length === 0; // others wait for their places
      this.scene.add(part);
      return part;
    });
  }

  // Lays an actuator along its points.
  #stretch(actuator, part) {
    if (!actuator.points.length) return;
    const at = actuator.points.map(({ index }) => new THREE.Vector3().fromArray(this.positions, 3 * index));
    if (at.length === 1)
      at.push(at[0].clone().addScaledVector(new THREE.Vector3(...actuator.direction), -12 * this.unit));
    const matrix = new THREE.Matrix4(), turn = new THREE.Quaternion();
    for (let k = 0; k + 1 < at.length; ++k) {
      const way = at[k + 1].clone().sub(at[k]);
      const length = way.length() || 1e-6;
      turn.setFromUnitVectors(kUp, way.divideScalar(length));
      matrix.compose(at[k].clone().add(at[k + 1]).multiplyScalar(0.5), turn, new THREE.Vector3(1, length, 1));
      part.setMatrixAt(k, matrix);
    }
    actuator.points.forEach((_, k) => part.userData.guides.setMatrixAt(k, matrix.makeTranslation(at[k])));
    part.visible = true;
    part.instanceMatrix.needsUpdate = part.userData.guides.instanceMatrix.needsUpdate = true;
  }

  #ramp(load) {
    const [from, to, share] = load < 0.5 ? [0, 1, 2 * load] : [1, 2, 2 * load - 1];
    return new THREE.Color().lerpColors(this.ramp[from], this.ramp[to], share);
  }

  // Floor with a grid, axes at its corner, workspace and path.
  #addSurroundings() {
    const { workspace_mm, motion } = this.robot.geometry;
    this.lines = [];
    this.labels = [];
    const add = (points, color, closed = false) => {
      const all = points.map((point) => new THREE.Vector3(...point));
      const line = new THREE.LineSegments(
        new THREE.BufferGeometry().setFromPoints(all.flatMap((point, k) =>
          k + 1 < all.length ? [point, all[k + 1]] : closed ? [point, all[0]] : [])),
        new THREE.LineBasicMaterial());
      line.userData.color = color;
      this.scene.add(line);
      this.lines.push(line);
    };
    this.grid = round(this.size / 12);
    const low = this.box.min, high = this.box.max, step = this.grid;
    const from = [Math.floor(low.x / step) - 1, Math.floor(low.y / step) - 1].map((k) => k * step);
    const to = [Math.ceil(high.x / step) + 1, Math.ceil(high.y / step) + 1].map((k) => k * step);
    const floor = low.z - this.unit;
    for (let x = from[0]; x <= to[0] + 1e-6; x += step) add([[x, from[1], floor], [x, to[1], floor]], "--grid");
    for (let y = from[1]; y <= to[1] + 1e-6; y += step) add([[from[0], y, floor], [to[0], y, floor]], "--grid");
    if (workspace_mm) this.scene.add(this.#box(...workspace_mm));
    if (motion) add(motion.waypoints_mm, "--quiet", motion.closed);
    const corner = new THREE.Vector3(low.x, low.y, floor);
    ["x", "y", "z"].forEach((axis, k) => {
      const way = new THREE.Vector3().setComponent(k, 1);
      const arrow = new THREE.ArrowHelper(way, corner, 1.2 * step, [0xd64545, 0x2e9e5b, 0x3b7dd8][k], 0.24 * step, 0.13 * step);
      this.scene.add(arrow);
      const label = new THREE.Sprite(new THREE.SpriteMaterial({ depthTest: false }));
      label.userData.text = axis;
      label.position.copy(corner).addScaledVector(way, 1.45 * step);
      label.scale.setScalar(0.4 * step);
      this.scene.add(label);
      this.labels.push(label);
    });
  }

  #box(low, high) {
    const size = new THREE.Vector3(...high).sub(new THREE.Vector3(...low));
    const edges = new THREE.LineSegments(new THREE.EdgesGeometry(new THREE.BoxGeometry(...size)),
      new THREE.LineDashedMaterial({ dashSize: 2 * this.unit, gapSize: 1.5 * this.unit }));
    edges.computeLineDistances();
    edges.position.set(...low).addScaledVector(size, 0.5);
    edges.userData.color = "--quiet";
    this.lines.push(edges);
    return edges;
  }

  #text(words) {
    const canvas = Object.assign(document.createElement("canvas"), { width: 64, height: 64 });
    const pen = canvas.getContext("2d");
    Object.assign(pen, { font: "44px system-ui, sans-serif", textAlign: "center", textBaseline: "middle",
      fillStyle: this.color("--quiet") });
    pen.fillText(words, 32, 32);
    return new THREE.CanvasTexture(canvas);
  }

  #addTip() {
    const ball = (radius, material) => {
      const mesh = new THREE.Mesh(new THREE.SphereGeometry(radius * this.unit, 20, 14), material);
      Object.assign(mesh, { visible: false, renderOrder: 5 });
      this.scene.add(mesh);
      return mesh;
    };
    const seen = () => new THREE.MeshBasicMaterial({ depthTest: false, transparent: true });
    const tip = { target: ball(0.7, seen()), model: ball(0.95, seen()), measured: ball(0.95, seen()), trails: {} };
    tip.target.renderOrder = 6;
    for (const which of ["model", "measured"]) tip.trails[which] = new Trail(this.scene);
    return tip;
  }

  #draw() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    // A narrow window shows the whole width of the robot too.
    this.camera.fov = 32 * Math.max(1, Math.min(1.9, 1.15 / this.camera.aspect));
    this.camera.updateProjectionMatrix();
    this.handle.face(this.camera);
    this.renderer.render(this.scene, this.camera);
    ++this.frames;
  }

  frames = 0;

  // Pixels that a millimetre has in the middle of the view.
  pixelsPerMm() {
    const away = this.camera.position.distanceTo(this.controls.target);
    return this.canvas.clientHeight / (2 * away * Math.tan(THREE.MathUtils.degToRad(this.camera.fov / 2)));
  }
}
