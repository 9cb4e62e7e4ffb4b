// Poses about the heart, the same at every run, and the answers of `dibs query`.
import { execFileSync } from "node:child_process";
import { join } from "node:path";

export const RATE = 30;
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

// The records of the program, pose by pose.
export function answers(program, folder) {
  return FRAMES.flatMap((frame) => {
    const lines = poses.filter((pose) => pose.frame === frame).map(({ numbers }) => numbers.join(","));
    const args = ["query", "heart.dibs", "--vertices", "heart.pc2", "--frame", String(frame), "--poses", "-"];
    const input = lines.join("\n") + "\n";
    const printed = execFileSync(program, args, { cwd: folder, input, maxBuffer: 1 << 26 });
    return printed.toString().trim().split("\n").map((line) => {
      const { line: _, ...answer } = JSON.parse(line);
      return answer;
    });
  });
}

// The names of the fields that differ in a bit.
export function differences(expected, found) {
  const same = (one, other) =>
    Array.isArray(one) ? Array.isArray(other) && one.length === other.length && one.every((value, at) => same(value, other[at])) : Object.is(one, other);
  const names = new Set([...Object.keys(expected), ...Object.keys(found)]);
  return [...names].filter((name) => !same(expected[name], found[name]));
}

export const program = (folder) => join(folder, "../../release/dibs");
