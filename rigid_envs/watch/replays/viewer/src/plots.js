// Plots in step with the motion: the past is strong, the future pale, a line is now.
import { COLORS, DASHES, lineSample, niceTicks, readable } from "./scales.js";

const MARGIN = { left: 46, right: 10, top: 6, bottom: 18 };

export class Plot {
  // data: title, unit, kind ("time" or "plan"), names, and for each episode `x` and `lines`
  constructor(parent, data, clock, labels) {
    this.data = data;
    this.clock = clock;
    this.card = document.createElement("figure");
    this.card.className = `plot ${data.kind}`;
    this.card.dataset.plot = data.key;
    const caption = document.createElement("figcaption");
    const title = document.createElement("strong");
    title.textContent = data.title;
    const unit = document.createElement("span");
    unit.className = "unit";
    unit.textContent = data.unit;
    caption.append(title, unit);
    this.canvas = document.createElement("canvas");
    this.legend = document.createElement("div");
    this.legend.className = "legend";
    this.card.append(caption, this.canvas, this.legend);
    this.entries = data.kind === "plan" ? [] : this.addLegend(labels);
    parent.append(this.card);
    this.canvas.addEventListener("pointerdown", (event) => this.grab(event));
  }

  addLegend(labels) {
    const entries = [];
    this.data.episodes.forEach((episode, e) => {
      if (!episode) return;
      episode.lines.forEach((values, k) => {
        const item = document.createElement("span");
        const swatch = document.createElement("i");
        swatch.style.background = lineSample(e, this.color(k, e));
        const name = document.createElement("span");
        const several = this.data.episodes.length > 1 && this.data.names.length === 1;
        name.textContent = several ? labels[e] : this.data.names[k];
        const value = document.createElement("output");
        item.append(swatch, name, value);
        this.legend.append(item);
        entries.push({ episode, values, value });
      });
    });
    return entries;
  }

  color(k, e) {
    const alone = this.data.kind === "plan" || this.data.names.length === 1;
    return COLORS[(alone ? e : k) % COLORS.length];
  }

  grab(event) {
    if (this.data.kind === "plan") return;
    const seek = ({ clientX }) => {
      const box = this.canvas.getBoundingClientRect();
      const share = (clientX - box.left - MARGIN.left) / (box.width - MARGIN.left - MARGIN.right);
      this.clock.seek(share * this.clock.duration);
    };
    this.canvas.setPointerCapture(event.pointerId);
    this.canvas.onpointermove = seek;
    this.canvas.onpointerup = () => { this.canvas.onpointermove = null; };
    seek(event);
  }

  // Draw what does not move, pale and strong.
  layout() {
    const box = this.canvas.getBoundingClientRect();
    if (!box.width) return;
    this.ratio = Math.min(window.devicePixelRatio || 1, 3);
    this.width = box.width;
    this.height = box.height;
    this.canvas.width = Math.round(box.width * this.ratio);
    this.canvas.height = Math.round(box.height * this.ratio);
    this.setScales();
    this.pale = this.layer((pen) => { this.drawAxes(pen); this.drawLines(pen, 0.28); });
    this.strong = this.layer((pen) => { this.drawAxes(pen); this.drawLines(pen, 1); });
    this.draw();
  }

  layer(paint) {
    const canvas = document.createElement("canvas");
    canvas.width = this.canvas.width;
    canvas.height = this.canvas.height;
    const pen = canvas.getContext("2d");
    pen.scale(this.ratio, this.ratio);
    paint(pen);
    return canvas;
  }

  setScales() {
    const shown = this.data.episodes.filter((episode) => episode);
    let [low, high] = range(shown.flatMap((episode) => episode.lines));
    let [left, right] = [0, this.clock.duration];
    const inner = [this.width - MARGIN.left - MARGIN.right, this.height - MARGIN.top - MARGIN.bottom];
    if (this.data.kind === "plan") {
      [left, right] = range(shown.map((episode) => episode.x));
      const unit = Math.max((right - left) / inner[0], (high - low) / inner[1], 1e-9) * 1.08;
      const middle = [(left + right) / 2, (low + high) / 2];
      [left, right] = [middle[0] - (unit * inner[0]) / 2, middle[0] + (unit * inner[0]) / 2];
      [low, high] = [middle[1] - (unit * inner[1]) / 2, middle[1] + (unit * inner[1]) / 2];
    } else {
      [low, high] = padded(low, high);
    }
    this.x = (value) => MARGIN.left + ((value - left) / (right - left || 1)) * inner[0];
    this.y = (value) => MARGIN.top + ((high - value) / (high - low)) * inner[1];
    this.span = { left, right, low, high };
  }

  drawAxes(pen) {
    const { left, right, low, high } = this.span;
    pen.font = "10px system-ui, sans-serif";
    pen.fillStyle = "#66707e";
    pen.strokeStyle = "#e4e8ee";
    pen.lineWidth = 1;
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    const rows = niceTicks(low, high, this.height < 120 ? 3 : 4);
    for (const value of rows) {
      const y = Math.round(this.y(value)) + 0.5;
      stroke(pen, MARGIN.left, y, this.width - MARGIN.right, y);
      pen.fillText(readable(value, rows), MARGIN.left - 5, y);
    }
    pen.textAlign = "center";
    pen.textBaseline = "top";
    const columns = niceTicks(left, right, 5);
    columns.forEach((value, k) => {
      const x = Math.round(this.x(value)) + 0.5;
      stroke(pen, x, MARGIN.top, x, this.height - MARGIN.bottom);
      const unit = k === columns.length - 1 && this.data.kind !== "plan" ? " s" : "";
      const at = Math.min(x, this.width - 14);
      pen.fillText(readable(value, columns) + unit, at, this.height - MARGIN.bottom + 4);
    });
  }

  drawLines(pen, opacity) {
    pen.globalAlpha = opacity;
    pen.lineWidth = 1.6;
    pen.lineJoin = "round";
    this.data.episodes.forEach((episode, e) => {
      if (!episode) return;
      pen.setLineDash(DASHES[e]);
      episode.lines.forEach((values, k) => {
        pen.strokeStyle = this.color(k, e);
        pen.beginPath();
        for (let i = 0; i < values.length; i++) {
          const y = this.y(values[i]);
          if (this.data.held) pen.lineTo(this.x(i ? episode.x[i - 1] : 0), y);
          pen.lineTo(this.x(episode.x[i]), y);
        }
        pen.stroke();
      });
    });
    pen.setLineDash([]);
    pen.globalAlpha = 1;
  }

  draw() {
    if (!this.pale) return;
    const pen = this.canvas.getContext("2d");
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.clearRect(0, 0, this.canvas.width, this.canvas.height);
    pen.drawImage(this.data.kind === "plan" ? this.strong : this.pale, 0, 0);
    if (this.data.kind === "time") this.drawPast(pen);
    pen.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    if (this.data.kind === "time") {
      const x = this.x(this.clock.time);
      pen.strokeStyle = "#29303b";
      pen.lineWidth = 1;
      stroke(pen, x, MARGIN.top, x, this.height - MARGIN.bottom);
    }
    this.drawDots(pen);
    for (const { episode, values, value } of this.entries) {
      value.value = short(values[this.index(episode)]);
    }
  }

  drawPast(pen) {
    const width = Math.round(this.x(this.clock.time) * this.ratio);
    if (width < 1) return;
    pen.clearRect(0, 0, width, this.canvas.height);
    pen.drawImage(this.strong, 0, 0, width, this.canvas.height, 0, 0, width, this.canvas.height);
  }

  drawDots(pen) {
    this.data.episodes.forEach((episode, e) => {
      if (!episode) return;
      const i = this.index(episode);
      episode.lines.forEach((values, k) => {
        const at = this.data.kind === "plan" || this.clock.time > episode.end
          ? episode.x[i] : this.clock.time;
        pen.fillStyle = this.color(k, e);
        pen.beginPath();
        pen.arc(this.x(at), this.y(values[i]), 3, 0, 2 * Math.PI);
        pen.fill();
      });
    });
  }

  // The moment that is shown now: the last one that has been reached, or the step that goes on.
  index(episode) {
    const { x, times = x } = episode;
    const time = this.clock.time + 1e-9;
    let i = times.findIndex((t) => t > time);
    if (i < 0) i = times.length;
    if (!this.data.held) i -= 1;
    return Math.min(Math.max(i, 0), x.length - 1);
  }
}

const stroke = (pen, x0, y0, x1, y1) => {
  pen.beginPath();
  pen.moveTo(x0, y0);
  pen.lineTo(x1, y1);
  pen.stroke();
};

// An axis around two ends. Where they differ by less than a thousandth of themselves, the curve is
// flat: an axis of their difference would have labels of ten digits.
function padded(low, high) {
  const size = Math.max(Math.abs(low), Math.abs(high), 1e-12);
  const pad = high - low < 1e-3 * size ? 0.5 * size : 0.06 * (high - low);
  return [low - pad, high + pad];
}

function range(lines) {
  let [low, high] = [Infinity, -Infinity];
  for (const values of lines) {
    for (const value of values) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  return low <= high ? [low, high] : [0, 1];
}

function short(value) {
  if (value === 0) return "0";
  const size = Math.abs(value);
  return size < 1e-3 || size >= 1e5 ? value.toExponential(2) : value.toPrecision(4);
}
