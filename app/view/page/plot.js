// SPDX-License-Identifier: Apache-2.0
// A plot of the last seconds of a few values.

const kSpan_s = 10;
const kSteps = [1, 2, 5];

// The next larger round number: 1, 2 or 5 times a power of ten.
export function round(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  for (const step of kSteps) if (step * power >= value * 0.999) return step * power;
  return 10 * power;
}

const text = (value) => (value === null || !Number.isFinite(value) ? "–"
  : Math.abs(value) >= 100 ? value.toFixed(0) : Math.abs(value) >= 10 ? value.toFixed(1) : value.toFixed(2));

export class Plot {
  #samples = []; // {time, values}
  #canvas;
  #legends;

  // series: [{name, color}], a color being the name of a custom property of the page, or a color
  constructor(parent, title, unit, series, smallest = 1) {
    this.unit = unit;
    this.series = series;
    this.smallest = smallest; // span of values
    const box = parent.appendChild(document.createElement("div"));
    box.className = "plot";
    const head = box.appendChild(document.createElement("h2"));
    head.appendChild(document.createElement("b")).textContent = `${title}, ${unit}`;
    this.#legends = series.map(() => head.appendChild(document.createElement("span")));
    this.#canvas = box.appendChild(document.createElement("canvas"));
    this.#canvas.setAttribute("aria-label", `${title} in ${unit} over the last ${kSpan_s} s`);
  }

  // values: one a series, null where there is none
  add(time, values) {
    const last = this.#samples.at(-1);
    if (last && time < last.time) this.#samples = []; // another machine's clock, or another run
    this.#samples.push({ time, values });
    while (this.#samples[0].time < time - kSpan_s) this.#samples.shift();
  }

  draw(color) {
    const canvas = this.#canvas;
    const { clientWidth: width, clientHeight: height } = canvas;
    if (width === 0) return;
    const ratio = devicePixelRatio;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    const pen = canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    let least = Infinity, most = -Infinity;
    for (const { values } of this.#samples)
      for (const value of values)
        if (value !== null) [least, most] = [Math.min(least, value), Math.max(most, value)];
    if (least > most) return;
    least = Math.min(least, least >= 0 ? 0 : least);
    most = Math.max(most, most <= 0 ? 0 : most, least + this.smallest);
    const step = round((most - least) / 3);
    least = Math.floor(least / step + 1e-9) * step;
    most = Math.ceil(most / step - 1e-9) * step;
    const left = 40, top = 5, bottom = height - 5;
    const now = this.#samples.at(-1).time;
    const x = (time) => width - 2 - ((now - time) / kSpan_s) * (width - left - 2);
    const y = (value) => bottom - ((value - least) / (most - least)) * (bottom - top);
    pen.font = "11px system-ui, sans-serif";
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    for (let value = least; value <= most + step / 2; value += step) {
      pen.strokeStyle = color("--line");
      pen.lineWidth = 1;
      pen.beginPath();
      pen.moveTo(left, y(value));
      pen.lineTo(width, y(value));
      pen.stroke();
      pen.fillStyle = color("--quiet");
      pen.fillText(String(+value.toFixed(6)), left - 6, y(value));
    }
    this.series.forEach((series, k) => {
      pen.strokeStyle = color(series.color);
      pen.lineWidth = 1.6;
      pen.lineJoin = "round";
      pen.beginPath();
      let on = false;
      for (const { time, values } of this.#samples) {
        if (values[k] === null) { on = false; continue; }
        if (on) pen.lineTo(x(time), y(values[k]));
        else pen.moveTo(x(time), y(values[k]));
        on = true;
      }
      pen.stroke();
      const value = this.#samples.at(-1).values[k];
      this.#legends[k].textContent = `${series.name} ${text(value)}`;
      this.#legends[k].style.color = color(series.color);
    });
  }
}
