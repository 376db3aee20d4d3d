// SPDX-License-Identifier: Apache-2.0
// Where a point has been in the last seconds, as a line that fades.

import * as THREE from "./three.module.js";

const kPoints = 200;

export class Trail {
  #places = [];

  constructor(scene) {
    const geometry = new THREE.BufferGeometry();
    for (const name of ["position", "color"])
      geometry.setAttribute(name, new THREE.BufferAttribute(new Float32Array(3 * kPoints), 3));
    this.line = new THREE.Line(geometry, new THREE.LineBasicMaterial({ vertexColors: true, depthTest: false, transparent: true }));
    this.line.frustumCulled = false;
    this.line.renderOrder = 4;
    scene.add(this.line);
  }

  dress(color, background) {
    this.color = new THREE.Color(color);
    this.background = new THREE.Color(background);
  }

  add(place) {
    this.#places.push(place);
    if (this.#places.length > kPoints) this.#places.shift();
    const { position, color } = this.line.geometry.attributes;
    const faded = new THREE.Color();
    this.#places.forEach((at, k) => {
      position.setXYZ(k, ...at);
      faded.lerpColors(this.background, this.color, (k + 1) / this.#places.length);
      color.setXYZ(k, faded.r, faded.g, faded.b);
    });
    position.needsUpdate = color.needsUpdate = true;
    this.line.geometry.setDrawRange(0, this.#places.length);
  }
}
