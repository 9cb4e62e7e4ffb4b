// Writes the measured figures and the pictures into docs/.
import { copyFile, readFile, writeFile } from "node:fs/promises";
import { cpus } from "node:os";
import { basename, join } from "node:path";
import { fileURLToPath } from "node:url";

const docs = fileURLToPath(new URL("../../docs", import.meta.url));
const [BEGIN, END] = ["<!-- measured: written by `cargo xtask viewer --test --record` -->\n", "<!-- end of measured -->"];

export async function recordPage(measured, pictures) {
  const path = join(docs, "viewer.md");
  const page = await readFile(path, "utf8");
  const [head, rest] = page.split(BEGIN);
  const [, tail] = rest.split(END);
  const { frame, ticks, work, commands, size, version } = measured;
  const text =
    `\nHeadless ${version} on ${cpus().length} × ${cpus()[0].model.trim()}, shared with other work; generated heart of ` +
    "10,272 triangles, beating at 1,000 ticks a second:\n\n" +
    "| | |\n|---|---|\n" +
    `| a tick, by the tracker | ${ticks.tracker.toFixed(1)} µs |\n` +
    `| a tick, by a whole query, warm | ${ticks.warm.toFixed(1)} µs |\n` +
    `| a tick, by a whole query, cold | ${ticks.cold.toFixed(1)} µs |\n` +
    `| a frame of 17 ticks, without drawing | ${work.toFixed(1)} ms |\n` +
    `| the drawing's commands, without their execution | ${commands.toFixed(1)} ms |\n` +
    `| a frame, drawn in software (SwiftShader, 1280 × 800) | ${frame.toFixed(0)} ms |\n` +
    `| the file | ${size.toLocaleString("en")} bytes |\n\n` +
    `At 60 frames a second a frame has 16.7 ms: a graphics card, which none was here to measure, has ${(16.7 - work - commands).toFixed(1)} ms of ` +
    "them for 10,272 triangles.\n\n";
  await writeFile(path, head + BEGIN + text + END + tail);
  for (const picture of pictures) await copyFile(picture, join(docs, basename(picture)));
}
