// The session compiled to WebAssembly answers with the bits of `dibs query`: `node bits.mjs SESSION-FOLDER HEART-FOLDER`.

// Requirement: P-09

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFile, writeFile } from "node:fs/promises";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { inflateSync } from "node:zlib";
import { record, touching } from "../page/record.js";
import { answers, contacts, differences, otherContacts, poses, program, RATE, TREE } from "./poses.mjs";

const [sessionFolder, folder] = process.argv.slice(2);
const { initSync, Session } = await import(pathToFileURL(join(sessionFolder, "session.js")));
initSync({ module: await readFile(join(sessionFolder, "session_bg.wasm")) });

// The data elements alone, as `dibs view` puts them into a page.
await writeFile(join(folder, "empty.html"), "<!--data-->");
const view = ["view", TREE, "--motion", "heart.pc2", "--page", "empty.html", "-o", "data.html"];
execFileSync(program(folder), view, { cwd: folder });
const data = await readFile(join(folder, "data.html"), "utf8");
const text = (id) => data.match(new RegExp(`id="${id}">([^<]*)<`))[1];
const bytes = (id) => inflateSync(Buffer.from(text(id), "base64"));
const facts = JSON.parse(text("facts"));
const session = new Session(bytes("tree"), bytes("motion"), facts.rate);

const MARGIN = 10;
// Held surface, cold query, the tree's limit: what `dibs query` asks.
session.set(session.limit(), MARGIN, 0xffffffff, Uint8Array.of(0, 2, 0));
const expected = answers(program(folder), folder);
const expectedContacts = contacts(program(folder), folder, MARGIN);
const sides = new Set();
let touched = 0;
poses.forEach(({ frame, numbers }, number) => {
  const time = (frame + 0.25) / RATE;
  session.advance(numbers, numbers, time, time, 1);
  const found = record(session, facts);
  sides.add(found.side);
  assert.deepEqual(differences(expected[number], found), [], `pose ${number}: ${JSON.stringify(found)}`);
  const contacts = touching(session);
  touched += contacts.contacts.length;
  assert.deepEqual(otherContacts(expectedContacts[number], contacts), [], `contacts of pose ${number}`);
});
for (const side of ["outside", "inside", "crossing"]) assert(sides.has(side), `no pose is ${side}`);
assert(touched > poses.length / 4, `${touched} contacts`);
console.log(`${poses.length} poses, ${touched} contacts: WebAssembly and the program agree to the bit`);
