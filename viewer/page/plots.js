// Live plots: a value a frame, the newest on the right.

const LENGTH = 300;

class Plot {
  constructor(parent, title, unit, colour) {
    const figure = document.createElement("figure");
    figure.className = "plot";
    figure.innerHTML = "<figcaption><span></span><b></b></figcaption><canvas width='588' height='80'></canvas>";
    figure.querySelector("span").textContent = title;
    parent.append(figure);
    this.value = figure.querySelector("b");
    this.canvas = figure.querySelector("canvas");
    this.canvas.setAttribute("aria-label", title);
    Object.assign(this, { unit, colour, high: [], low: [] });
  }

  // `low` is given for a band: an interval.
  push(high, low, shown) {
    this.high.push(high);
    this.low.push(low ?? high);
    if (this.high.length > LENGTH) {
      this.high.shift();
      this.low.shift();
    }
    this.value.textContent = shown + this.unit;
  }

  draw() {
    const { canvas, high, low } = this;
    const context = canvas.getContext("2d");
    const { width, height } = canvas;
    const known = [...high, ...low].filter(Number.isFinite);
    const most = Math.max(...known, 0);
    const least = Math.min(...known, 0);
    const y = (value) => height - 4 - ((value - least) / (most - least || 1)) * (height - 8);
    const x = (at) => width - (high.length - 1 - at) * (width / (LENGTH - 1));
    context.clearRect(0, 0, width, height);
    context.fillStyle = context.strokeStyle = "#c3ccd6";
    context.fillRect(0, y(0), width, 1);
    context.fillStyle = context.strokeStyle = this.colour;
    context.globalAlpha = 0.25;
    context.beginPath();
    high.forEach((value, at) => context.lineTo(x(at), y(value)));
    for (let at = low.length - 1; at >= 0; at--) context.lineTo(x(at), y(low[at]));
    context.fill();
    context.globalAlpha = 1;
    context.lineWidth = 2;
    context.beginPath();
    high.forEach((value, at) => context.lineTo(x(at), y(value)));
    context.stroke();
  }
}

export class Plots {
  constructor(parent) {
    this.separation = new Plot(parent, "separation, interval", " mm", "#0072b2");
    this.nodes = new Plot(parent, "node tests a tick", "", "#009e73");
    this.triangles = new Plot(parent, "triangle tests a tick", "", "#d55e00");
    this.time = new Plot(parent, "time a tick, mean of the last 32 frames", " µs", "#a3407a");
    // The browser's clock is coarse: many ticks are timed together.
    this.recent = [];
  }

  push(answer, [ticks, nodes, triangles], milliseconds) {
    this.recent.push([ticks, milliseconds]);
    if (this.recent.length > 32) this.recent.shift();
    const sum = (column) => this.recent.reduce((all, frame) => all + frame[column], 0);
    this.microseconds = (1000 * sum(1)) / sum(0);
    const interval = answer.separation - answer.lower;
    const wide = interval > 0 ? `${answer.lower.toFixed(2)} … ` : "";
    this.separation.push(answer.separation, answer.lower, wide + answer.separation.toFixed(2));
    this.nodes.push(nodes / ticks, null, (nodes / ticks).toFixed(1));
    this.triangles.push(triangles / ticks, null, (triangles / ticks).toFixed(1));
    this.time.push(this.microseconds, null, this.microseconds.toFixed(1));
    for (const plot of [this.separation, this.nodes, this.triangles, this.time]) plot.draw();
  }
}
