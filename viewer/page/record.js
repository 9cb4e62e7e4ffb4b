// A session's arrays as the record that `dibs query --json` prints.

const COVERAGES = ["measured", "proven"];

export const SIDES = ["outside", "inside", "crossing", "undefined", "either"];

export function record(session, facts) {
  const numbers = session.answer();
  let at = 0;
  const one = () => numbers[at++];
  const three = () => [one(), one(), one()];
  return {
    separation: one(),
    lower: one(),
    accuracy: one(),
    // JSON has no infinity, which an interval has where the instrument may be inside at any depth.
    interval: [one(), one()].map((end) => (Number.isFinite(end) ? end : null)),
    coverage: COVERAGES[one()],
    side: SIDES[one()],
    side_reason: session.side_reason() || null,
    axis_distance: one(),
    point_on_surface: three(),
    point_on_tool: three(),
    direction: three(),
    axis_parameter: one(),
    tree: facts.tree,
    tool: 0,
    triangle: three(),
    barycentric: three(),
    stretch: one(),
    node_tests: one(),
    triangle_tests: one(),
  };
}

// The force and the contacts, in the tree's coordinates.
export function touching(session) {
  const numbers = session.touching();
  const vector = (at) => [...numbers.slice(at, at + 3)];
  const contacts = [];
  for (let at = 6; at < numbers.length; at += 13) {
    const [on_surface, on_tool, normal, velocity] = [1, 4, 7, 10].map((place) => vector(at + place));
    contacts.push({ separation: numbers[at], on_surface, on_tool, normal, velocity });
  }
  return { force: vector(0), isSaturated: numbers[3] !== 0, isSafe: numbers[4] !== 0, bound: numbers[5], contacts };
}
