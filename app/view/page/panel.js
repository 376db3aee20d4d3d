// SPDX-License-Identifier: Apache-2.0
// What the page says in words and numbers, and its buttons.

import { distance, measuredPlace, place } from "./robot.js";

const $ = (id) => document.getElementById(id);
const kModes = { path: "play", paused: "pause", hold: "hold" };

// Writes only what has changed.
function say(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

export class Panel {
  // ask(command, more): a promise, see Connection.ask
  constructor(ask) {
    this.ask = ask;
    this.control = { allowed: false, held: false }; // by the token; by this page
    for (const button of document.querySelectorAll("button[data-command]"))
      button.onclick = () => this.#do(button.dataset.command);
    $("control").onclick = () => this.#toggleControl();
    $("stop").onclick = () => this.#stop();
    $("speed").oninput = () => say($("speed-text"), `${$("speed").value} %`);
    $("speed").onchange = () => this.#do("set", { path_rate: $("speed").value / 100 });
    this.#enable();
  }

  async #do(command, more) {
    try {
      await this.ask(command, more);
      this.asked?.(command);
      this.say("");
    } catch (error) {
      this.say(error.message);
    }
  }

  async #toggleControl() {
    if (this.control.held) {
      await this.#do("release");
      this.setControl({ held: false });
      return;
    }
    const steal = Boolean(this.holder);
    if (steal && !confirm(`${this.holder} has the control. Take it away?`)) return;
    try {
      await this.ask("acquire", { steal });
      this.setControl({ held: true });
      this.say("");
    } catch (error) {
      this.say(error.message);
    }
  }

  #stop() {
    if (confirm("End the run? The robot comes to a halt and its drives are disabled.")) this.#do("stop");
  }

  setControl(change) {
    Object.assign(this.control, change);
    this.#enable();
    this.controlChanged?.(this.control);
  }

  #enable() {
    const { allowed, held } = this.control;
    say($("control"), !allowed ? "Watching only" : held ? "Give control back" : "Take control");
    $("control").disabled = !allowed;
    $("control").title = allowed ? "" : "open the address with the token that tendril-view printed";
    for (const element of document.querySelectorAll("button[data-command], #speed")) element.disabled = !held;
    // Whoever may press anything may stop the robot.
    for (const element of document.querySelectorAll("#stop, [data-command=disable]")) element.disabled = !allowed;
    $("hint").hidden = !held;
  }

  // A sentence for the person; empty: none.
  say(text) {
    say($("message"), text);
    $("message").hidden = text === "";
  }

  lost(why) {
    this.setControl({ held: false });
    say($("phase"), "no daemon");
    $("lamp").className = "";
    this.say(`${why}; looking again`);
  }

  // Another robot.
  build(robot) {
    this.robot = robot;
    document.title = `${robot.name} – Tendril`;
    say($("robot"), robot.name);
    this.say("");
    $("faults").replaceChildren();
    this.faults = "";
    $("actuators").replaceChildren(...robot.actuators.map((actuator) => {
      const row = document.createElement("div");
      row.className = "actuator";
      row.innerHTML = '<span></span><div class="bar"><i></i></div><span></span><span></span>';
      row.children[0].textContent = row.title = actuator.name;
      return row;
    }));
    $("effectors").innerHTML = "<tr><th></th><th>target</th><th>model</th><th>measured</th><th>error</th></tr>";
    this.rows = new Map();
    for (const effector of robot.effectors) {
      const names = effector.points.length ? [...effector.coordinates].map((axis) => `${effector.name}.${axis}`) : [`${effector.name}.volume`];
      for (const name of names) {
        const row = $("effectors").insertRow();
        for (let k = 0; k < 5; ++k) row.insertCell();
        row.cells[0].textContent = name.endsWith("volume") ? `${name}, ml` : name;
        this.rows.set(name, row);
      }
    }
  }

  show(state, color, load) {
    this.holder = state.control;
    say($("phase"), state.phase);
    $("lamp").className = state.faults.length || state.fault ? "" : state.phase === "run" ? "run" : "wait";
    say($("mode"), state.mode);
    say($("holder"), this.control.held ? "this page" : (state.control ?? "nobody"));
    for (const button of document.querySelectorAll("button[data-command]"))
      button.classList.toggle("now", kModes[state.mode] === button.dataset.command);
    if (document.activeElement !== $("speed") && $("speed").value !== String(Math.round(100 * state.path_rate))) {
      $("speed").value = 100 * state.path_rate;
      say($("speed-text"), `${Math.round(100 * state.path_rate)} %`);
    }
    const faults = state.fault ? [`${state.fault.what}. ${state.fault.do} Then reset.`] : state.faults;
    if (faults.join() !== this.faults)
      $("faults").replaceChildren(...faults.map((fault) =>
        Object.assign(document.createElement("li"), { textContent: fault })));
    this.faults = faults.join();
    this.robot.actuators.forEach((actuator, k) => {
      const { displacement, effort } = state.actuators[actuator.name];
      const row = $("actuators").children[k];
      const bar = row.querySelector("i");
      bar.style.width = `${100 * load(actuator, effort)}%`;
      bar.style.background = color(load(actuator, effort));
      say(row.children[2], `${(effort * actuator.effort.factor).toFixed(2)} ${actuator.effort.unit}`);
      say(row.children[3], `${(displacement * actuator.length.factor).toFixed(2)} ${actuator.length.unit}`);
    });
    for (const [name, row] of this.rows) {
      const factor = name.endsWith("volume") ? 1e6 : 1e3;
      const number = (value) => (value === undefined || value === null ? "–" : (factor * value).toFixed(2));
      const target = state.target?.[name], model = state.model?.[name], measured = state.measured[name]?.value;
      [target, model, measured].forEach((value, k) => say(row.cells[k + 1], number(value)));
      const seen = measured ?? model;
      say(row.cells[4], target === undefined || seen === undefined ? "–" : number(seen - target));
    }
  }
}

// How far model and measured tip are from the target, mm; null where that is not known.
export function errors(robot, state, positions) {
  const effector = robot.effectors.find((each) => each.points.length);
  if (!effector || !state.target || !positions) return [null, null];
  const target = place(effector, state.target, positions);
  const measured = measuredPlace(effector, state.measured, positions);
  return [distance(target, place(effector, state.model, positions)), measured && distance(target, measured)];
}
