// Settings: sliders and choices. A change calls `changed`.

const BUDGET_STEPS = 60;

// From 1 test to 5,000, by equal ratios; the last step is no limit.
const budgetOf = (step) => (step >= BUDGET_STEPS ? 0xffffffff : Math.round(5000 ** (step / (BUDGET_STEPS - 1))));

const SPHERES = [
  ["none", "none", "No spheres"],
  ["level", "of a level", "The bounding spheres of one level of the tree"],
  ["tested", "tested by a query", "Those that a whole query for this pose tests, without its side"],
  ["front", "tracker's front", "Those that have a bound from the last tick: every triangle is below one of them"],
];
const SURFACES = [
  ["0", "held", "Between frames the surface is the last frame's"],
  ["1", "interpolated", "On its way from the frame before: late by a frame"],
  ["2", "extrapolated", "Beyond the last frame, as it moved before"],
];
const SEARCHES = [
  ["0", "tracker", "Tests only the bounds that motion has used up since the last tick"],
  ["1", "query, warm", "A whole query that starts from the last answer's triangle"],
  ["2", "query, cold", "A whole query that knows nothing of the last tick"],
];
const RADII = [
  ["1", "measured stretch", "Spheres grow by the stretch that was measured"],
  ["0", "tree's limit", "Spheres grow by the largest stretch that the tree admits"],
];
const TOOLS = [
  ["path", "along the path", "The instrument follows the file of its poses, a line a millisecond"],
  ["hand", "by hand", "The instrument stays where the hand leaves it"],
];

export class Controls {
  constructor(form, { limit, levels, hasMotion, hasPath, hasNodes, extent }, changed) {
    this.form = form;
    this.limit = limit;
    const most = Math.max(limit, 1);
    form.innerHTML =
      (hasMotion || hasPath ? group("Motion", '<button type="button" id="play" title="Time goes on, or stands still (Space)"></button>' +
        (hasPath ? choices("tool", TOOLS, "path") : "") +
        (hasMotion ? choices("between", SURFACES, "1") : "")) : "") +
      group("Query", choices("search", SEARCHES, "0") +
        slider("budget", "budget", "Most node tests, and most triangle tests, of a tick", 0, BUDGET_STEPS, 1, BUDGET_STEPS) +
        slider("margin", "margin", "Contacts and the wall's force reach this far from the surface", 0, round(extent / 4), round(extent / 200), round(extent / 20)) +
        slider("limit", "stretch limit", "A frame stretched by more is refused, and the last one held", 1, most, 0.001, most)) +
      group("Spheres", choices("spheres", SPHERES, "none") + slider("level", "level", "Of the tree, 0 is its root", 0, levels - 1, 1, Math.min(3, levels - 1)) +
        choices("measured", RADII, "1")) +
      group("Surface", slider("opacity", "opacity", "Of the surface", 0.1, 1, 0.05, 1) + check("wire", "triangles", "The edges of the surface's triangles") +
        (hasNodes ? check("nodes", "nodes", "The nodes of the coarse model that moves the surface", " checked") : ""));
    const update = () => {
      this.show();
      changed();
    };
    form.addEventListener("input", update);
    form.addEventListener("submit", (event) => event.preventDefault());
    this.show();
  }

  value(name) {
    return this.form.elements[name]?.value;
  }

  number(name) {
    return Number(this.value(name));
  }

  set(name, value) {
    this.form.elements[name].value = value;
    this.form.dispatchEvent(new Event("input"));
  }

  get budget() {
    return budgetOf(this.number("budget"));
  }

  get largestStretch() {
    // The slider rounds: its end is the tree's own limit.
    const slider = this.form.elements.limit;
    return Number(slider.value) >= Number(slider.max) - 0.001 ? this.limit : Number(slider.value);
  }

  get choices() {
    return Uint8Array.of(this.value("between") ?? 0, this.value("search"), this.value("measured"));
  }

  show() {
    const say = (name, words) => (this.form.querySelector(`[data-for=${name}]`).textContent = words);
    say("budget", this.budget === 0xffffffff ? "no limit" : `${this.budget} tests`);
    say("margin", `${this.number("margin").toFixed(1)} mm`);
    say("limit", this.largestStretch.toFixed(3));
    say("level", this.value("level"));
    say("opacity", `${Math.round(100 * this.number("opacity"))} %`);
  }
}

const round = (value) => Number(value.toPrecision(2));

const group = (title, rows) => `<fieldset><legend>${title}</legend><div>${rows}</div></fieldset>`;

const slider = (name, title, tip, low, high, step, value) =>
  `<label class="row" title="${tip}"><span>${title}</span><input type="range" name="${name}" min="${low}" max="${high}" step="${step}" value="${value}"><output data-for="${name}"></output></label>`;

const check = (name, title, tip, state = "") =>
  `<label class="choice" title="${tip}"><input type="checkbox" name="${name}"${state}> ${title}</label>`;

const choices = (name, values, chosen) =>
  `<div role="radiogroup" aria-label="${name}">` +
  values.map(([value, title, tip]) => `<label class="choice" title="${tip}"><input type="radio" name="${name}" value="${value}"${value === chosen ? " checked" : ""}> ${title}</label>`).join("") +
  "</div>";
