// The page's data: the session's code, a tree, a motion and the facts about them.
import { initSync, Session } from "session";
import { recorded, unpack } from "./path.js";

const text = (id) => document.getElementById(id)?.textContent ?? "";

async function inflate(id) {
  const packed = Uint8Array.from(atob(text(id)), (letter) => letter.charCodeAt(0));
  if (packed.length === 0) return packed;
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// Facts are what `dibs view` knows: names, the motion's rate. The path of the instrument and the record of its
// ticks are packed apart, and join them.
export async function open() {
  if (!text("facts")) throw new Error("This page has no tree in it: write one with `dibs view TREE -o PAGE`.");
  const facts = JSON.parse(text("facts"));
  initSync({ module: await inflate("wasm") });
  const session = new Session(await inflate("tree"), await inflate("motion"), facts.rate);
  facts.path = unpack(await inflate("path"));
  facts.commanded = unpack(await inflate("commanded"));
  facts.ticks = recorded(unpack(await inflate("ticks")), facts.reasons);
  return { facts, session };
}
