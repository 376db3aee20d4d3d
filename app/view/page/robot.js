// SPDX-License-Identifier: Apache-2.0
// What a robot is made of, from the answers "greeting" and "geometry", in what people read: mm, ml, N, kPa.

const kAxes = "xyz";

export class Robot {
  constructor(greeting, geometry) {
    this.name = greeting.robot;
    this.rate = greeting.rate; // Hz
    this.geometry = geometry;
    this.nodes = geometry.surface.nodes_mm.length;
    let next = this.nodes; // points follow the nodes in a surface's positions
    const places = (points) => (points ?? []).map((point) => ({ ...point, index: next++ }));
    this.actuators = geometry.actuators.map((actuator) => {
      const volume = actuator.kind === "cavity";
      return {
        ...actuator,
        points: places(actuator.points),
        length: volume ? { unit: "ml", factor: 1e6 } : { unit: "mm", factor: 1e3 },
        effort: volume ? { unit: "kPa", factor: 1e-3 } : { unit: "N", factor: 1 },
      };
    });
    this.effectors = geometry.effectors.map((effector) => ({ ...effector, points: places(effector.points) }));
  }

  // The share of its limit that an effort is, from 0 to 1.
  load(actuator, effort) {
    const limit = effort < 0 ? actuator.effort_limits[0] : actuator.effort_limits[1];
    return limit === 0 ? 0 : Math.min(1, Math.abs(effort / limit));
  }
}

// Where an effector of points is, mm: controlled coordinates as told, m, the others where the body has them.
export function place(effector, coordinates, positions) {
  return [...kAxes].map((axis, k) => {
    const told = coordinates?.[`${effector.name}.${axis}`];
    if (told !== undefined) return 1000 * (told.value ?? told);
    let sum = 0;
    for (const point of effector.points) sum += positions[3 * point.index + k];
    return sum / effector.points.length;
  });
}

// The measured place; null where no sensor tells all that is controlled.
export function measuredPlace(effector, measured, positions) {
  for (const axis of effector.coordinates)
    if (!measured?.[`${effector.name}.${axis}`]) return null;
  return place(effector, measured, positions);
}

export const distance = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
