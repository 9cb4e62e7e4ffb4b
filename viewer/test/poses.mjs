// Poses about the heart, the same at every run, and the answers of `dibs query`.
import { execFileSync } from "node:child_process";
import { join } from "node:path";

export const RATE = 30;
// By a path: the record has it as it was given.
export const TREE = "./heart.dibs";
export const FRAMES = [0, 7, 12, 21];

// Numerical Recipes' generator: enough for poses.
let state = 18;
const random = () => (state = (Math.imul(state, 1664525) + 1013904223) >>> 0) / 2 ** 32;
const between = (low, high) => Math.round(1e4 * (low + (high - low) * random())) / 1e4;

export const poses = Array.from({ length: 100 }, (_, number) => {
  const point = () => [between(-60, 90), between(-70, 60), between(-40, 110)];
  const start = point();
  // Spheres, short capsules, which fit into the wall, and long ones.
  const ends = [() => [], () => start.map((axis) => axis + between(-5, 5)), point][number % 3]();
  const numbers = [...start, ...ends];
  return { frame: FRAMES[Math.floor(number / 25)], numbers: [...numbers, between(0, 4)] };
});

// Contacts that a session keeps.
const ROOM = 16;

// The records of the program, pose by pose.
export const answers = (program, folder) => ask(program, folder, []);

// Its contacts within a margin, pose by pose.
export const contacts = (program, folder, margin) => ask(program, folder, ["--contacts", String(margin)]);

function ask(program, folder, options) {
  return FRAMES.flatMap((frame) => {
    const lines = poses.filter((pose) => pose.frame === frame).map(({ numbers }) => numbers.join(","));
    const args = ["query", TREE, "--vertices", "heart.pc2", "--frame", String(frame), "--poses", "-", ...options];
    const input = lines.join("\n") + "\n";
    const printed = execFileSync(program, args, { cwd: folder, input, maxBuffer: 1 << 26 });
    return printed.toString().trim().split("\n").map((line) => {
      const { line: _, ...answer } = JSON.parse(line);
      return answer;
    });
  });
}

const same = (one, other) =>
  Array.isArray(one) ? Array.isArray(other) && one.length === other.length && one.every((value, at) => same(value, other[at])) : Object.is(one, other);

// The session's stretch is the bound that a query takes: rounded up, and larger where a triangle has a limit of its own. The
// program's is the largest of any triangle.
const isBound = (found, expected) => found >= expected && found < 1.6;

// The names of the fields that differ in a bit.
export function differences(expected, found) {
  const names = new Set([...Object.keys(expected), ...Object.keys(found)]);
  return [...names].filter((name) => !(name === "stretch" ? isBound(found[name], expected[name]) : same(expected[name], found[name])));
}

// The contacts that differ in a bit: the program's record, and what the page draws.
export function otherContacts({ contacts, contacts_bound }, found) {
  const wrong = [];
  if (found.contacts.length !== Math.min(contacts.length, ROOM)) wrong.push(`${found.contacts.length} of ${contacts.length}`);
  if (contacts.length <= ROOM && !same(contacts_bound, found.bound)) wrong.push(`bound ${found.bound}, not ${contacts_bound}`);
  found.contacts.forEach(({ separation, on_surface, on_tool, normal }, at) => {
    const { separation: distance, point_on_surface, point_on_tool, normal: outward } = contacts[at] ?? {};
    if (!same([separation, on_surface, on_tool, normal], [distance, point_on_surface, point_on_tool, outward])) wrong.push(at);
  });
  return wrong;
}

export const program = (folder) => join(folder, "../../release/dibs");
