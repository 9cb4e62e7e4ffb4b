// Writes the measured figures and the picture into docs/.
import { copyFile, readFile, writeFile } from "node:fs/promises";
import { cpus } from "node:os";
import { join } from "node:path";
import { fileURLToPath } from "node:url";

const docs = fileURLToPath(new URL("../../docs", import.meta.url));
const [BEGIN, END] = ["<!-- measured: written by `cargo xtask viewer --test --record` -->\n", "<!-- end of measured -->"];

export async function recordPage(measured, picture) {
  const path = join(docs, "viewer.md");
  const page = await readFile(path, "utf8");
  const [head, rest] = page.split(BEGIN);
  const [, tail] = rest.split(END);
  const row = (name, { frame, tick }) => `| ${name} | ${tick.toFixed(1)} | ${frame.toFixed(0)} |\n`;
  const text =
    `\nHeadless ${measured.version} on ${cpus().length} × ${cpus()[0].model.trim()}, drawing in software (SwiftShader), ` +
    "generated heart of 10,272 triangles, 1,000 ticks a second, 1280 × 800 pixels:\n\n" +
    "| search | µs a tick | ms a frame |\n|---|---|---|\n" +
    row("tracker", measured.tracker) + row("query, warm", measured.warm) + row("query, cold", measured.cold) +
    `\nWithout drawing, which a graphics card shortens, a frame with 17 ticks takes ${measured.work.toFixed(1)} ms. The file has ${measured.size.toLocaleString("en")} bytes.\n\n`;
  await writeFile(path, head + BEGIN + text + END + tail);
  await copyFile(picture, join(docs, "viewer.png"));
}
