// Live plots: a value a frame, the newest on the right.

const LENGTH = 300;

// Ends of an axis, by powers of ten.
const ENDS = [1, 1.5, 2, 3, 4, 5, 6, 8, 10];

// The least end at or beyond a value.
function end(value) {
  const size = Math.abs(value);
  if (size === 0) return 0;
  const power = 10 ** Math.floor(Math.log10(size));
  return Math.sign(value) * power * (ENDS.find((end) => end * power >= size) ?? 10);
}

// Without the digits that a product of powers leaves.
const axis = (value) => String(Number(value.toPrecision(3)));

class Plot {
  // `colour` names a colour of the style.
  constructor(parent, title, tip, unit, colour) {
    const figure = document.createElement("figure");
    figure.className = "plot";
    figure.title = tip;
    figure.innerHTML =
      "<figcaption><span></span><b></b></figcaption>" +
      "<div><i class='most'></i><canvas width='588' height='80'></canvas><i class='least'></i></div>";
    figure.querySelector("span").textContent = title;
    parent.append(figure);
    const part = (name) => figure.querySelector(name);
    Object.assign(this, { value: part("b"), canvas: part("canvas"), top: part(".most"), bottom: part(".least") });
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
    this.value.textContent = shown === "" ? "" : shown + this.unit;
  }

  draw(colours) {
    const { canvas, high, low } = this;
    const context = canvas.getContext("2d");
    const { width, height } = canvas;
    const known = [...high, ...low].filter(Number.isFinite);
    const most = end(Math.max(...known, 0));
    const least = end(Math.min(...known, 0));
    this.top.textContent = axis(most);
    this.bottom.textContent = axis(least);
    const y = (value) => height - 4 - ((value - least) / (most - least || 1)) * (height - 8);
    const x = (at) => width - (high.length - 1 - at) * (width / (LENGTH - 1));
    context.clearRect(0, 0, width, height);
    context.fillStyle = context.strokeStyle = colours("--zero");
    context.fillRect(0, y(0), width, 1);
    context.fillStyle = context.strokeStyle = colours(this.colour);
    context.globalAlpha = 0.25;
    context.beginPath();
    high.forEach((value, at) => context.lineTo(x(at), y(value)));
    for (let at = low.length - 1; at >= 0; at--) context.lineTo(x(at), y(low[at]));
    context.fill();
    context.globalAlpha = 1;
    context.lineWidth = 2;
    context.beginPath();
    // A value that is not known leaves a gap.
    high.forEach((value, at) => context[Number.isFinite(high[at - 1]) ? "lineTo" : "moveTo"](x(at), y(value)));
    context.stroke();
  }
}

export class Plots {
  // `recorded` says which values the record of the ticks has.
  constructor(parent, recorded) {
    const plot = (...about) => new Plot(parent, ...about);
    this.separation = plot("separation, interval", "The closest pair's separation, and the interval that is certain", " mm", "--accent");
    if (recorded.least) this.least = plot("kept by the admitted motion", "The filter's promise: the instrument comes no nearer on its way", " mm", "--commanded");
    if (recorded.energy) this.energy = plot("energy left", "The energy that the wall may still give to the hand", " mJ", "--touching");
    this.nodes = plot("node tests a tick", "Bounding spheres tested, in the mean of a frame's ticks", "", "--sphere");
    this.triangles = plot("triangle tests a tick", "Exact tests of triangles, in the mean of a frame's ticks", "", "--inside");
    this.time = plot("time a tick", "Of a tick's query in this browser, the mean of the last 32 frames", " µs", "--time");
    const time = document.createElement("p");
    time.className = "time";
    time.innerHTML = `<span>${LENGTH} frames of the page ago</span><span>now</span>`;
    parent.append(time);
    this.all = [this.separation, this.least, this.energy, this.nodes, this.triangles, this.time].filter(Boolean);
    // The browser's clock is coarse: many ticks are timed together.
    this.recent = [];
    this.dress();
  }

  // Takes the colours of the style, which the browser's light or dark mode decides.
  dress() {
    const style = getComputedStyle(document.documentElement);
    const known = {};
    this.colours = (name) => (known[name] ??= style.getPropertyValue(name).trim());
    for (const plot of this.all) plot.draw(this.colours);
  }

  push(answer, [ticks, nodes, triangles], milliseconds, recorded) {
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
    const known = (value) => (Number.isFinite(value) ? value.toFixed(2) : "");
    this.least?.push(recorded?.least ?? NaN, null, known(recorded?.least));
    this.energy?.push(recorded?.energy ?? NaN, null, known(recorded?.energy));
    for (const plot of this.all) plot.draw(this.colours);
  }
}
