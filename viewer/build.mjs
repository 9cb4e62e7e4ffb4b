// Bundles the page into one file without data: `node build.mjs FOLDER`, with the session that `bindgen` wrote there.
import { build } from "esbuild";
import { readFile, writeFile } from "node:fs/promises";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import { deflateSync } from "node:zlib";

const folder = process.argv[2];
const here = fileURLToPath(new URL(".", import.meta.url));

const { outputFiles } = await build({
  entryPoints: [join(here, "page/main.js")],
  bundle: true,
  minify: true,
  format: "esm",
  target: "es2022",
  // three's licence, which its copies must keep.
  legalComments: "inline",
  alias: { session: join(folder, "session.js") },
  write: false,
});
// Inside a script element, this alone would end it.
const script = outputFiles[0].text.replaceAll("</script", "<\\/script");
const style = await readFile(join(here, "page/style.css"), "utf8");
const wasm = deflateSync(await readFile(join(folder, "session_bg.wasm")), { level: 9 });

let page = await readFile(join(here, "page/index.html"), "utf8");
const fill = (mark, text) => {
  if (!page.includes(mark)) throw new Error(`index.html has no ${mark}`);
  page = page.replace(mark, () => text);
};
fill("/*style*/", style);
fill("<!--wasm-->", `<script type="text/plain" id="wasm">${wasm.toString("base64")}</script>`);
fill("/*script*/", script);
await writeFile(join(folder, "dibs-viewer.html"), page);
