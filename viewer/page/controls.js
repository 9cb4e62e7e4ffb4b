// Settings: sliders and choices. A change calls `changed`.

const BUDGET_STEPS = 60;

// From 1 test to 5,000, by equal ratios; the last step is no limit.
const budgetOf = (step) => (step >= BUDGET_STEPS ? 0xffffffff : Math.round(5000 ** (step / (BUDGET_STEPS - 1))));

const SPHERES = [["none", "none"], ["level", "of a level"], ["tested", "tested by a query"], ["front", "tracker's front"]];
const SURFACES = [["0", "held"], ["1", "interpolated"], ["2", "extrapolated"]];
const SEARCHES = [["0", "tracker"], ["1", "query, warm"], ["2", "query, cold"]];
const RADII = [["1", "measured stretch"], ["0", "tree's limit"]];

export class Controls {
  constructor(form, { limit, levels, hasMotion, hasPath, extent }, changed) {
    this.form = form;
    this.limit = limit;
    const most = Math.max(limit, 1);
    form.innerHTML =
      group("Motion", (hasMotion || hasPath ? '<button type="button" id="play"></button>' : "") +
        (hasPath ? choices("tool", [["path", "along the path"], ["hand", "by hand"]], "path") : "") +
        (hasMotion ? choices("between", SURFACES, "1") : "")) +
      group("Query", choices("search", SEARCHES, "0") +
        slider("budget", "budget", 0, BUDGET_STEPS, 1, BUDGET_STEPS) +
        slider("margin", "margin", 0, round(extent / 4), round(extent / 200), round(extent / 20)) +
        slider("limit", "stretch limit", 1, most, 0.001, most)) +
      group("Spheres", choices("spheres", SPHERES, "none") + slider("level", "level", 0, levels - 1, 1, Math.min(3, levels - 1)) +
        choices("measured", RADII, "1")) +
      group("Surface", slider("opacity", "opacity", 0.1, 1, 0.05, 1) + '<label class="choice"><input type="checkbox" name="wire"> triangles</label>');
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

const slider = (name, title, low, high, step, value) =>
  `<label class="row"><span>${title}</span><input type="range" name="${name}" min="${low}" max="${high}" step="${step}" value="${value}"><output data-for="${name}"></output></label>`;

const choices = (name, values, chosen) =>
  `<div role="radiogroup" aria-label="${name}">` +
  values.map(([value, title]) => `<label class="choice"><input type="radio" name="${name}" value="${value}"${value === chosen ? " checked" : ""}> ${title}</label>`).join("") +
  "</div>";
