// The answer in numbers.

const element = (id) => document.getElementById(id);

// What is called touching is outside still: the axis is, the instrument's body overlaps.
const WORDS = { outside: "outside", inside: "inside", crossing: "crossing", undefined: "side undefined", either: "in or out" };

export class Numbers {
  constructor(facts, session) {
    document.title = `${facts.name} – dibs view`;
    element("name").textContent = facts.name;
    const count = (number, noun) => `${number.toLocaleString("en")} ${noun}${number === 1 ? "" : "s"}`;
    const frames = facts.frames > 1 ? `, ${count(facts.frames, "frame")} at ${facts.rate} Hz` : "";
    const nodes = session.nodes().length / 3;
    const moved = nodes > 0 ? ` moved by ${count(nodes, "node")}` : "";
    element("facts-line").textContent = count(session.triangles().length / 3, "triangle") + moved + frames;
    this.has = {
      filter: facts.ticks.some(({ reason }) => reason !== undefined),
      energy: facts.ticks.some(({ energy }) => Number.isFinite(energy)),
      least: facts.ticks.some(({ least }) => Number.isFinite(least)),
    };
    for (const id of ["filter", "energy"]) element(id).parentElement.hidden = !this.has[id];
  }

  // `recorded` is the record of this tick, `short` the distance (mm) between the commanded and the admitted pose, where known.
  show(answer, touching, refused, recorded, short) {
    const { separation, lower, accuracy, side, stretch } = answer;
    const overlaps = side === "outside" && separation <= 0;
    element("separation").querySelector("output").value = separation.toFixed(3);
    element("side").textContent = overlaps ? "touching" : WORDS[side];
    element("side").className = overlaps ? "touching" : side === "crossing" ? "inside" : side;
    element("interval").textContent = `${(lower - accuracy).toFixed(4)} to ${(separation + accuracy).toFixed(4)} mm`;
    element("stretch").textContent = refused ? `frame refused: stretched by ${refused.toFixed(3)}` : stretch.toFixed(3);
    element("stretch").className = refused ? "refused" : "";
    const bound = touching.bound < Infinity && touching.bound > -Infinity ? `, all below ${touching.bound.toFixed(1)} mm` : "";
    element("contacts").textContent = touching.contacts.length + bound;
    element("speed").textContent = moving(touching.contacts[0]);
    const newtons = Math.hypot(...touching.force);
    const state = touching.isSafe ? " (the wall only damps: cut short)" : touching.isSaturated ? " (the largest)" : "";
    element("force").textContent = `${newtons.toFixed(2)} N${state}`;
    if (this.has.filter) element("filter").textContent = filtered(recorded, short);
    if (this.has.energy) {
      const energy = recorded?.energy;
      element("energy").textContent = Number.isFinite(energy) ? `${energy.toFixed(3)} mJ left` : "no account in this tick";
    }
    if (element("record-box").open) element("record").textContent = JSON.stringify(answer, null, 1);
  }
}

function filtered(recorded, short) {
  if (recorded?.reason === undefined) return "no filter in this tick";
  const away = short > 0.0005 ? `, ${short.toFixed(2)} mm from the command` : "";
  const kept = Number.isFinite(recorded.least) ? `; no nearer than ${recorded.least.toFixed(3)} mm` : "";
  return recorded.reason + away + kept;
}

// The surface's velocity at a contact: its length, and its part along the normal, which leads out.
function moving(contact) {
  if (!contact) return "no contact";
  const speed = Math.hypot(...contact.velocity);
  const outwards = contact.velocity.reduce((sum, axis, at) => sum + axis * contact.normal[at], 0);
  if (speed === 0) return "still at the contact";
  return `${speed.toFixed(1)} mm/s, ${Math.abs(outwards).toFixed(1)} ${outwards < 0 ? "inwards" : "outwards"}`;
}
