// The page: a loop that lets the session tick and draws its last tick.
import { Controls } from "./controls.js";
import { open } from "./data.js";
import { Hand } from "./hand.js";
import { Numbers } from "./numbers.js";
import { Plots } from "./plots.js";
import { record, touching } from "./record.js";
import { Picture } from "./scene.js";

const element = (id) => document.getElementById(id);

// Ticks a second, as a controller makes them.
const RATE = 1000;

function say(message) {
  element("message").textContent = message;
  element("message").hidden = false;
}

function draw(triangles, positions) {
  try {
    return new Picture(element("view"), triangles, positions);
  } catch {
    say("This browser has no WebGL, so nothing is drawn. The query, its numbers and its plots work, and keys move the instrument.");
    return null;
  }
}

// A capsule beside the surface, its tip towards the middle.
function beside(positions) {
  const axes = [0, 1, 2].map((axis) => positions.filter((_, at) => at % 3 === axis));
  const ranges = axes.map((values) => values.reduce(([low, high], value) => [Math.min(low, value), Math.max(high, value)], [Infinity, -Infinity]));
  const middle = ranges.map(([low, high]) => (low + high) / 2);
  const extent = Math.hypot(...ranges.map(([low, high]) => high - low));
  const towards = [0.62, -0.62, 0.48];
  const at = (share) => middle.map((value, axis) => value + share * extent * towards[axis]);
  return { extent, pose: [...at(0.34), ...at(0.75), 0.02 * extent] };
}

// Most (mm) by which an end of an instrument is elsewhere in another pose.
function apart(one, other) {
  if (!one || one.length !== other.length) return NaN;
  const ends = one.length === 7 ? [0, 3] : [0];
  return Math.max(...ends.map((at) => Math.hypot(...[0, 1, 2].map((axis) => one[at + axis] - other[at + axis]))));
}

class Viewer {
  constructor({ facts, session }) {
    const positions = session.positions();
    Object.assign(this, { facts, session, tick: -1, last: performance.now(), isPlaying: facts.frames > 1 || facts.path.length > 0 });
    const { extent, pose } = beside(positions);
    this.from = this.to = facts.path[0] ?? pose;
    this.origin = session.origin();
    this.picture = draw(session.triangles(), positions);
    this.numbers = new Numbers(facts, session);
    this.plots = new Plots(element("plots"), this.numbers.has);
    const about = {
      limit: session.limit(), levels: session.levels(), extent, hasMotion: facts.frames > 1, hasPath: facts.path.length > 0,
      hasNodes: session.nodes().length > 0,
    };
    for (const [name, isThere] of [["commanded", facts.commanded.length > 0], ["node", about.hasNodes]]) {
      document.querySelector(`#legend .${name}`).hidden = !isThere;
    }
    this.controls = new Controls(element("controls"), about, () => this.configure());
    this.hand = new Hand(element("view"), this.picture, () => this.to, (moved) => this.take(moved));
    element("play")?.addEventListener("click", () => this.play(!this.isPlaying));
    element("view").addEventListener("keydown", (event) => {
      if (event.key === " ") {
        event.preventDefault();
        this.play(!this.isPlaying);
      } else if (event.key.toLowerCase() === "r" && !event.ctrlKey && !event.metaKey) {
        this.picture?.reset();
      }
    });
    element("reset").hidden = !this.picture;
    element("reset").addEventListener("click", () => this.picture?.reset());
    const scheme = matchMedia("(prefers-color-scheme: dark)");
    scheme.addEventListener("change", () => this.dress());
    this.dress();
    this.play(this.isPlaying);
    this.configure();
  }

  // A hand on the instrument takes it off its path.
  take(pose) {
    if (this.controls.value("tool") === "path") this.controls.set("tool", "hand");
    this.to = pose;
  }

  play(isPlaying) {
    this.isPlaying = isPlaying;
    if (element("play")) element("play").textContent = isPlaying ? "❚❚ Stop" : "▶ Play";
  }

  // Takes the colours of the browser's light or dark mode.
  dress() {
    this.plots.dress();
    this.picture?.dress(this.plots.colours("--ink"));
  }

  // The tick's line of the path and of the record, or -1 while a hand has the instrument.
  get line() {
    return this.controls.value("tool") === "path" && this.tick < this.facts.path.length ? this.tick : -1;
  }

  configure() {
    const { controls, session } = this;
    session.set(controls.largestStretch, controls.number("margin"), controls.budget, controls.choices);
    this.picture?.look({ opacity: controls.number("opacity"), wire: controls.form.elements.wire.checked });
  }

  // Back to the first tick.
  restart() {
    this.session.restart();
    this.tick = -1;
    this.from = this.to = this.facts.path[0] ?? this.to;
  }

  // A filter's admitted pose is that at the end of its tick, and its surface the tissue's: an interpolated one is late by a frame.
  seconds(tick) {
    const isLate = (this.controls?.value("between") ?? "1") === "1";
    const ahead = this.facts.commanded.length > 0 ? 1 / RATE + (isLate ? 1 / this.facts.rate : 0) : 0;
    return Math.max(tick, 0) / RATE + ahead;
  }

  // So many ticks, during which time goes on unless it is stopped.
  advance(ticks) {
    const isOnPath = this.isPlaying && this.controls.value("tool") === "path";
    const before = performance.now();
    let counts = [0, 0, 0, 0];
    if (isOnPath) {
      const { path } = this.facts;
      // A line of the path is a tick. After the last one path and motion begin anew together, as they were recorded.
      for (let left = ticks; left > 0; left--) {
        if (this.tick + 1 >= path.length && path.length > 1) this.restart();
        this.tick++;
        this.from = this.to;
        this.to = path[this.tick % path.length];
        const one = this.session.advance(this.from, this.to, this.seconds(this.tick - 1), this.seconds(this.tick), 1);
        counts = counts.map((count, at) => count + one[at]);
      }
    } else {
      const start = this.tick;
      if (this.isPlaying) this.tick += ticks;
      counts = [...this.session.advance(this.from, this.to, this.seconds(start), this.seconds(this.tick), ticks)];
    }
    const milliseconds = performance.now() - before;
    this.from = this.to;
    return { counts, milliseconds };
  }

  spheres() {
    switch (this.controls.value("spheres")) {
      case "level": return this.session.level(this.controls.number("level"));
      case "tested": return this.session.tested();
      case "front": return this.session.front();
      default: return new Float32Array();
    }
  }

  // A frame of the page.
  frame(now) {
    // After a pause of the browser, time goes on from where it was.
    const seconds = Math.min((now - this.last) / 1000, 0.1);
    this.last = now;
    this.step(Math.max(1, Math.round(seconds * RATE)));
    requestAnimationFrame((next) => this.frame(next));
  }

  // Ticks, and a picture of the last.
  step(ticks) {
    const { session, picture } = this;
    try {
      const { counts, milliseconds } = this.advance(ticks);
      const answer = record(session, this.facts);
      const contacts = (this.touching = touching(session));
      const { facts, line } = this;
      const [command, recorded] = [facts.commanded[line], facts.ticks[line]];
      this.plots.push(answer, counts, milliseconds, recorded);
      this.numbers.show(answer, contacts, session.refused(), recorded, apart(command, this.to));
      if (picture) {
        picture.move(session.positions());
        picture.tool.pose(this.to);
        picture.command(command);
        picture.nodes(this.controls.form.elements.nodes?.checked ? session.nodes() : new Float32Array());
        picture.show(answer, this.origin, contacts);
        picture.spheres.show(this.spheres());
        picture.draw();
      }
    } catch (error) {
      say(error.message ?? String(error));
      this.from = this.to;
    }
  }
}

try {
  const viewer = new Viewer(await open());
  // For scripts: `viewer.take(pose)`, `viewer.tick`, `viewer.step(ticks)`, `viewer.controls.set(name, value)`.
  window.viewer = viewer;
  requestAnimationFrame((now) => viewer.frame(now));
} catch (error) {
  say(error.message ?? String(error));
}
