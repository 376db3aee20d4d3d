// SPDX-License-Identifier: Apache-2.0
// The ring by which a person drags the target, in the plane of the view.

import * as THREE from "./three.module.js";

export class Handle {
  dragged = false;
  enabled = false;

  // moved(effector, mm): called while it is dragged, with a place within the workspace
  constructor(view, moved) {
    this.view = view;
    this.moved = moved;
    this.effector = view.robot.effectors.findIndex((effector) => effector.points.length);
    const ring = new THREE.TorusGeometry(3.4 * view.unit, 0.38 * view.unit, 10, 40);
    this.ring = new THREE.Mesh(ring, new THREE.MeshBasicMaterial({ depthTest: false, transparent: true }));
    this.grip = new THREE.Mesh(new THREE.SphereGeometry(6 * view.unit), new THREE.MeshBasicMaterial({ visible: false }));
    this.ring.renderOrder = 7;
    this.ring.visible = false;
    this.ring.add(this.grip);
    view.scene.add(this.ring);
    this.ray = new THREE.Raycaster();
    this.ended = new AbortController();
    const listen = (name, does) => view.canvas.addEventListener(name, does, { signal: this.ended.signal, capture: true });
    listen("pointerdown", (event) => this.#grasp(event));
    listen("pointermove", (event) => this.#drag(event));
    for (const name of ["pointerup", "pointercancel"]) listen(name, (event) => this.#release(event));
  }

  dispose() {
    this.ended.abort();
  }

  dress(color) {
    this.ring.material.color.set(color);
  }

  // It stays at the goal that a person gave until the target is there.
  follow(target) {
    this.ring.visible = this.enabled && target !== null;
    if (!target || this.dragged) return;
    const at = new THREE.Vector3(...target);
    if (this.goal && this.goal.distanceTo(at) > 0.05 && performance.now() < this.until) return;
    this.goal = null;
    this.ring.position.copy(at);
  }

  // Forgets the goal: something else was asked for.
  forget() {
    this.goal = null;
  }

  face(camera) {
    this.ring.quaternion.copy(camera.quaternion);
  }

  #aim(event) {
    const box = this.view.canvas.getBoundingClientRect();
    const at = new THREE.Vector2((2 * (event.clientX - box.left)) / box.width - 1, 1 - (2 * (event.clientY - box.top)) / box.height);
    this.ray.setFromCamera(at, this.view.camera);
  }

  #grasp(event) {
    if (!this.ring.visible || event.button !== 0) return;
    this.#aim(event);
    this.ring.updateMatrixWorld(true);
    if (!this.ray.intersectObject(this.grip).length) return;
    this.dragged = true;
    this.view.controls.enabled = false;
    this.view.canvas.setPointerCapture(event.pointerId);
    this.plane = new THREE.Plane().setFromNormalAndCoplanarPoint(
      this.view.camera.getWorldDirection(new THREE.Vector3()), this.ring.position);
    event.stopPropagation();
  }

  #drag(event) {
    if (!this.dragged) return;
    event.stopPropagation();
    this.#aim(event);
    const at = this.ray.ray.intersectPlane(this.plane, new THREE.Vector3());
    if (!at) return;
    const { workspace_mm } = this.view.robot.geometry;
    if (workspace_mm) at.clamp(new THREE.Vector3(...workspace_mm[0]), new THREE.Vector3(...workspace_mm[1]));
    this.ring.position.copy(at);
    this.goal = at;
    this.until = performance.now() + 20_000;
    this.moved(this.effector, at.toArray());
    this.view.changed();
  }

  #release(event) {
    if (!this.dragged) return;
    event.stopPropagation();
    this.dragged = false;
    this.view.controls.enabled = true;
  }
}
