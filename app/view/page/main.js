// SPDX-License-Identifier: Apache-2.0
// The page of tendril-view: joins the connection with the scene, the panel and the plots.

import { Connection, positions as positionsOf } from "./connection.js";
import { Panel, errors } from "./panel.js";
import { Plot, round } from "./plot.js";
import { Robot, measuredPlace, place } from "./robot.js";

const kRate_hz = 30;
const kTargets_ms = 50; // between two targets of a drag
const $ = (id) => document.getElementById(id);
const style = getComputedStyle(document.documentElement);
const color = (name) => (name.startsWith("--") ? style.getPropertyValue(name).trim() : name);
const palette = ["#1f77b4", "#e07b00", "#2ca02c", "#d62780", "#8a6fd1", "#12a3a3", "#a0752c", "#7a8794"];

// For tests: what the page knows.
export const page = { robot: null, state: null, scene: null, surfaces: 0, positions: null };

const connection = new Connection(new URLSearchParams(location.hash.slice(1)).get("token"));
const panel = new Panel((command, more) => connection.ask(command, more));
let plots = {};
let snapshots = []; // [time, number] of the last half second

function loadColor(load) {
  const [from, to, share] = load < 0.5 ? ["--effort-0", "--effort-1", 2 * load] : ["--effort-1", "--effort-2", 2 * load - 1];
  return `color-mix(in srgb, ${color(from)}, ${color(to)} ${100 * share}%)`;
}

function buildPlots(robot) {
  $("plots").replaceChildren();
  const make = (...words) => new Plot($("plots"), ...words);
  plots = { error: make("error of the tip", "mm", [{ name: "model", color: "--model" }, { name: "measured", color: "--measured" }], 0.5) };
  for (const unit of ["mm", "ml"]) {
    const actuators = robot.actuators.filter((actuator) => actuator.length.unit === unit);
    if (!actuators.length) continue;
    const series = actuators.map(({ name }, k) => ({ name, color: palette[k % palette.length] }));
    plots[unit] = Object.assign(make("commands", unit, series), { actuators });
  }
  plots.cycle = make("time of a cycle", "µs", [{ name: "now", color: "--accent" }], 20);
  plots.rate = make("refreshes of the model", "Hz", [{ name: "now", color: "--accent" }], 20);
  plots.age = make("age of the snapshot", "ms", [{ name: "now", color: "--accent" }], 5);
}

// Refreshes of the model a second, over the last half second; null before that.
function modelRate(state) {
  snapshots.push([state.time, state.snapshot]);
  while (snapshots[0][0] < state.time - 0.5) snapshots.shift();
  const [time, number] = snapshots[0];
  return state.time > time ? (state.snapshot - number) / (state.time - time) : null;
}

function addToPlots(state) {
  const { time } = state;
  plots.error.add(time, errors(page.robot, state, page.positions));
  for (const unit of ["mm", "ml"])
    plots[unit]?.add(time, plots[unit].actuators.map(({ name, length }) => length.factor * state.actuators[name].command));
  plots.cycle.add(time, [1e6 * state.cycle_time]);
  plots.rate.add(time, [modelRate(state)]);
  plots.age.add(time, [1e3 * state.snapshot_age]);
}

async function buildScene(robot) {
  page.scene?.dispose();
  page.scene = null;
  try {
    const { Scene } = await import("./scene.js");
    // A canvas of its own for each: a WebGL context belongs to its canvas for good.
    const canvas = $("body").cloneNode();
    $("body").replaceWith(canvas);
    page.scene = new Scene(canvas, robot, color, drag);
    $("no-scene").hidden = true;
    showScale();
    page.scene.controls.addEventListener("change", showScale);
    page.scene.handle.enabled = panel.control.held;
  } catch (error) {
    $("no-scene").hidden = false;
    $("no-scene").textContent = `no 3D view: ${/module|fetch|import/i.test(error.message)
      ? "tendril-view was built without three.js" : error.message}`;
  }
}

function showScale() {
  const pixels = page.scene.pixelsPerMm();
  const length = round(60 / pixels);
  $("scale-bar").style.width = `${length * pixels}px`;
  $("scale-text").textContent = `${length} mm   (grid: ${page.scene.grid} mm)`;
}

// A drag sends so many targets a second, the last one included. The robot moves there at the speed of its path.
let wanted = null, timer = null;
function drag(effector, at) {
  wanted = { effector, at };
  timer ??= setTimeout(() => {
    timer = null;
    const { name, coordinates } = page.robot.effectors[wanted.effector];
    const position = {};
    for (const axis of coordinates) position[`${name}.${axis}`] = wanted.at["xyz".indexOf(axis)] / 1000;
    connection.ask("target", { position }).catch((error) => panel.say(error.message));
  }, kTargets_ms);
}

connection.addEventListener("greeting", async ({ detail }) => {
  try {
    const { geometry } = await connection.ask("geometry");
    page.robot = new Robot(detail, geometry);
    page.positions = null;
    snapshots = [];
    panel.build(page.robot);
    buildPlots(page.robot);
    await buildScene(page.robot);
    await connection.ask("subscribe", { rate: kRate_hz });
    await connection.ask("surface", { rate: kRate_hz });
  } catch (error) {
    panel.say(error.message);
  }
});

connection.addEventListener("state", ({ detail: state }) => {
  page.state = state;
  const { robot, scene, positions } = page;
  panel.show(state, loadColor, robot.load);
  addToPlots(state);
  if (!scene || !positions) return;
  scene.showEfforts(Object.fromEntries(Object.entries(state.actuators).map(([name, { effort }]) => [name, effort])));
  robot.effectors.forEach((effector, k) => {
    if (!effector.points.length) return;
    const known = (told) => told && place(effector, told, positions);
    const measured = measuredPlace(effector, state.measured, positions);
    $("measured-legend").hidden = !measured;
    scene.showTip(k, known(state.target), known(state.model), measured);
  });
});

connection.addEventListener("surface", ({ detail }) => {
  page.positions = positionsOf(detail);
  ++page.surfaces;
  page.scene?.show(page.positions);
});

connection.addEventListener("lost", ({ detail: why }) => panel.lost(why));

connection.addEventListener("view", ({ detail: view }) => {
  if ("control" in view) panel.setControl({ allowed: view.control });
  if (view.message && view.daemon !== false) panel.say(view.message);
});

connection.addEventListener("event", ({ detail }) => {
  if (detail.event !== "control_lost") return;
  panel.setControl({ held: false });
  panel.say(`${detail.to} has taken the control`);
});

panel.controlChanged = ({ held }) => page.scene && (page.scene.handle.enabled = held);
panel.asked = (command) => command !== "target" && page.scene?.handle.forget();

matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => page.scene?.dress());

setInterval(() => {
  if (!document.hidden) for (const plot of Object.values(plots)) plot.draw(color);
}, 80);
