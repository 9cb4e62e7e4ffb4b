// Opens pages of `dibs view` in Chromium and uses them as a hand would: `node browser.mjs HEART-FOLDER [--record]`.
// One file, because all checks share a browser and its helpers.

// Requirement: P-09

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFile, stat, writeFile } from "node:fs/promises";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import puppeteer from "puppeteer-core";
import { answers, contacts, differences, otherContacts, poses, program, TREE } from "./poses.mjs";
import { recordPage } from "./recorded.mjs";

const folder = process.argv[2];
const dibs = (...args) => execFileSync(program(folder), args, { cwd: folder, maxBuffer: 1 << 26 }).toString();
const pictures = join(folder, "..");
const PICTURE = join(pictures, "viewer.jpg");
const DEMO = join(folder, "../../demo");
// A demo of 15 s has room in a page that is sent by mail.
const MOST_BYTES = 3_000_000;
const SOFTWARE_GL = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"];

async function launch(flags) {
  return puppeteer.launch({ executablePath: "/usr/bin/chromium", headless: true, args: ["--no-sandbox", ...flags] });
}

const LARGE = { width: 1280, height: 800 };

// A page without an error on its console. Unless it runs, it draws a frame only when it is told to: drawing in software
// takes most of a test's time.
async function open(browser, name, { width = 640, height = 480, hasTouch = false, runs = false } = {}) {
  const page = await browser.newPage();
  page.complaints = [];
  page.on("console", (message) => message.type() === "error" && page.complaints.push(message.text()));
  page.on("pageerror", (error) => page.complaints.push(error.message));
  page.on("request", (request) => request.url().startsWith("http") && page.complaints.push(`asks for ${request.url()}`));
  await page.setViewport({ width, height, hasTouch });
  await page.goto(pathToFileURL(resolve(folder, name)).href);
  await page.waitForFunction("window.viewer?.numbers && document.getElementById('separation').innerText.length > 3");
  if (!runs) await page.evaluate(() => (viewer.frame = () => {}));
  return page;
}

const shot = (page, name) => page.screenshot({ path: join(pictures, `${name}.png`) });
const fresh = (page) => page.evaluate(() => viewer.step(1));
const shown = (page, id) => page.$eval(`#${id}`, (element) => element.textContent);
const set = (page, name, value) => page.evaluate((name, value) => viewer.controls.set(name, value), name, value);
const pose = (page) => page.evaluate(() => [...viewer.to]);

// Moves a slider as a user does, by its keys, from its lowest value on.
async function slide(page, name, steps) {
  await page.focus(`input[name=${name}]`);
  await page.keyboard.press("Home");
  for (let step = 0; step < steps; step++) await page.keyboard.press("ArrowRight");
  await fresh(page);
}

const record = (page) =>
  page.evaluate(() => {
    document.getElementById("record-box").open = true;
    viewer.step(1);
    return JSON.parse(document.getElementById("record").textContent);
  });

const checks = {
  async "100 poses have the numbers and contacts of `dibs query`"(page) {
    const expected = answers(program(folder), folder);
    await page.evaluate(() => viewer.play(false));
    for (const [name, value] of [["between", "0"], ["search", "2"], ["measured", "0"], ["margin", "10"]]) await set(page, name, value);
    // A slider has steps.
    const margin = await page.evaluate(() => viewer.controls.number("margin"));
    const touches = contacts(program(folder), folder, margin);
    for (const [number, { frame, numbers }] of poses.entries()) {
      await page.evaluate(
        (frame, numbers, rate) => {
          viewer.take(numbers);
          // A tick within the frame's time.
          viewer.tick = Math.ceil((frame * 1000) / rate) + 1;
        },
        frame, numbers, 30,
      );
      // JSON has no -0, and both print it as 0.
      const zeros = (key, value) => (Object.is(value, -0) ? 0 : value);
      const clean = (answer) => JSON.parse(JSON.stringify(answer, zeros), zeros);
      assert.deepEqual(differences(clean(expected[number]), clean(await record(page))), [], `pose ${number}`);
      const found = await page.evaluate(() => viewer.touching);
      assert.deepEqual(otherContacts(clean(touches[number]), clean(found)), [], `contacts of pose ${number}`);
    }
  },

  async "a drag of the middle moves, of an end turns"(page) {
    await page.evaluate(() => viewer.play(false));
    const grip = (share) =>
      page.evaluate((share) => {
        const { hand } = viewer;
        const [start, end] = [0, 3].map((at) => hand.seen(viewer.picture.tool.balls[at / 3].position));
        return [start.x + share * (end.x - start.x), start.y + share * (end.y - start.y)];
      }, share);
    const drag = async (share, across, down) => {
      const before = await pose(page);
      const [x, y] = await grip(share);
      await page.mouse.move(x, y);
      await page.mouse.down();
      await page.mouse.move(x + across, y + down, { steps: 4 });
      await page.mouse.up();
      await fresh(page);
      const after = await pose(page);
      const [moved, seen] = [after.map((value, at) => value - before[at]), await grip(share)];
      return { moved, error: Math.hypot(seen[0] - x - across, seen[1] - y - down) };
    };
    const middle = await drag(0.5, -60, 30);
    assert(Math.hypot(...middle.moved.slice(0, 3)) > 1, "the middle's drag moves");
    for (const axis of [0, 1, 2]) assert(Math.abs(middle.moved[axis] - middle.moved[axis + 3]) < 1e-3, "as a whole");
    assert(middle.error < 8, `it follows the mouse: off by ${middle.error} pixels`);
    const end = await drag(1, 20, 40);
    assert(Math.hypot(...end.moved.slice(0, 3)) === 0, "the other end stays");
    assert(Math.hypot(...end.moved.slice(3, 6)) > 1 && end.error < 2, `the end follows: off by ${end.error} pixels`);
    const camera = () => page.evaluate(() => viewer.picture.camera.position.toArray());
    const [eye, still] = [await camera(), await pose(page)];
    const corner = await page.$eval("#view canvas", (canvas) => canvas.getBoundingClientRect().bottom - 20);
    await page.mouse.move(20, corner);
    await page.mouse.down();
    await page.mouse.move(120, corner, { steps: 4 });
    await page.mouse.up();
    await fresh(page);
    assert.notDeepEqual(await camera(), eye, "a drag beside it turns the view");
    assert.deepEqual(await pose(page), still, "and leaves the instrument");
  },

  async "keys move, turn and stop"(page) {
    await page.focus("#view");
    for (const key of ["ArrowLeft", "ArrowUp", "PageUp", "w", "a"]) {
      const before = await pose(page);
      await page.keyboard.press(key);
      assert.notDeepEqual(await pose(page), before, key);
    }
    const before = await page.evaluate(() => viewer.isPlaying);
    await page.keyboard.press("Space");
    assert.equal(await page.evaluate(() => viewer.isPlaying), !before, "Space");
  },

  async "sliders do what they say"(page) {
    await page.evaluate(() => (viewer.play(false), viewer.tick = 0));
    await page.evaluate(() => viewer.take([20, -60, 40, 90, -90, 90, 3]));
    await set(page, "search", "2");
    let last = Infinity;
    for (const steps of [0, 20, 60]) {
      await slide(page, "budget", steps);
      const { lower, separation, node_tests } = await record(page);
      const budget = await page.evaluate(() => viewer.controls.budget);
      assert(node_tests <= budget + 1 && separation - lower <= last, `budget ${budget}`);
      assert(steps === 60 ? separation === lower : separation > lower, `the interval at budget ${budget}`);
      last = separation - lower;
    }
    const contacts = async () => {
      const [force, text] = [await shown(page, "force"), await shown(page, "contacts")];
      return { force: parseFloat(force), count: parseInt(text) };
    };
    await page.evaluate(() => viewer.take([30, -40, 40, 90, -90, 90, 3]));
    await slide(page, "margin", 0);
    const { separation } = await record(page);
    assert(separation > 0, `the instrument is outside: ${separation}`);
    assert.deepEqual(await contacts(), { force: 0, count: 0 }, "no margin");
    await page.focus("input[name=margin]");
    await page.keyboard.press("End");
    await fresh(page);
    const far = await contacts();
    assert(far.count > 0 && far.force > 0, `a margin beyond ${separation}: ${JSON.stringify(far)}`);

    // The frames of the contraction are stretched by more than 1.1.
    await slide(page, "limit", 0);
    await page.evaluate(() => (viewer.tick = 420));
    await fresh(page);
    assert.match(await shown(page, "stretch"), /frame refused/);
    const held = await page.evaluate(() => [...viewer.session.positions()]);
    await page.evaluate(() => (viewer.tick = 460));
    await fresh(page);
    assert.deepEqual(await page.evaluate(() => [...viewer.session.positions()]), held, "the surface is held");
    await page.focus("input[name=limit]");
    await page.keyboard.press("End");
    await fresh(page);
    assert.doesNotMatch(await shown(page, "stretch"), /refused/);

    await set(page, "spheres", "level");
    const count = () => page.evaluate(() => (viewer.step(1), viewer.picture.spheres.count));
    await slide(page, "level", 0);
    assert.equal(await count(), 1, "the root");
    await slide(page, "level", 2);
    const two = await count();
    await slide(page, "level", 3);
    assert((await count()) > two && two > 1, "more at a deeper level");
    await set(page, "spheres", "tested");
    const { node_tests } = await record(page);
    const tested = await count();
    assert(tested > 1 && tested <= node_tests, `${tested} spheres of ${node_tests} tests`);
    await set(page, "spheres", "front");
    assert.equal(await count(), 0, "a cold query has no front");
    await set(page, "search", "0");
    assert((await count()) > 10, "a tracker has one");
  },

  async "the page says what it shows"(page) {
    // The tree was named by its path.
    assert.equal(await shown(page, "name"), "heart.dibs");
    assert.match(await page.title(), /^heart\.dibs /);
    assert.match(await shown(page, "help"), /wheel zooms/);
    const untold = await page.evaluate(() => {
      const parts = document.querySelectorAll("aside output, aside dd, aside input, aside summary, #side, .plot, button");
      return [...parts].filter((part) => !part.closest("[title]")).map((part) => part.outerHTML);
    });
    assert.deepEqual(untold, [], "controls and numbers without a tooltip");
    await page.evaluate(() => viewer.play(false));
    for (let frame = 0; frame < 3; frame++) await fresh(page);
    const axes = await page.evaluate(() => [...document.querySelectorAll(".plot")].map((plot) => ({
      most: Number(plot.querySelector(".most").textContent), least: Number(plot.querySelector(".least").textContent),
      value: Number.parseFloat(plot.querySelector("b").textContent),
    })));
    assert.equal(axes.length, 4, "nothing is recorded, so nothing of it is plotted");
    for (const { most, least, value } of axes) assert(most > least && least <= value && value <= most, JSON.stringify(axes));
  },

  async "the wheel zooms, and the view is reset by button and by key"(page) {
    await page.evaluate(() => viewer.play(false));
    const eye = () => page.evaluate(() => (viewer.step(1), viewer.picture.camera.position.toArray().map((axis) => axis.toFixed(2))));
    const start = await eye();
    for (const reset of [() => page.click("#reset"), async () => (await page.focus("#view"), await page.keyboard.press("r"))]) {
      await page.mouse.move(30, 150);
      await page.mouse.wheel({ deltaY: 400 });
      assert.notDeepEqual(await eye(), start, "the wheel");
      await reset();
      assert.deepEqual(await eye(), start, "as at the start");
    }
  },

  async "the page is dark where the browser is"(page) {
    const seen = async (scheme) => {
      await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: scheme }]);
      // The page hears of it before one of its next frames.
      await page.waitForFunction(() => viewer.plots.colours("--ink") === getComputedStyle(document.documentElement).getPropertyValue("--ink").trim());
      await fresh(page);
      return page.evaluate(() => {
        const light = (colour) => colour.match(/[\d.]+/g).slice(0, 3).reduce((sum, part) => sum + Number(part) / 765, 0);
        const { backgroundColor, color } = getComputedStyle(document.querySelector("aside"));
        const pair = viewer.picture.pairColour.color;
        return { paper: light(backgroundColor), ink: light(color), pair: (pair.r + pair.g + pair.b) / 3, line: viewer.plots.colours("--time") };
      });
    };
    const [light, dark] = [await seen("light"), await seen("dark")];
    assert(light.paper > 0.9 && light.ink < 0.3 && light.pair < 0.1, JSON.stringify(light));
    assert(dark.paper < 0.2 && dark.ink > 0.8 && dark.pair > 0.6, JSON.stringify(dark));
    assert.notEqual(light.line, dark.line, "the plots' colours");
  },

  async "held, interpolated and extrapolated differ"(page) {
    await page.evaluate(() => viewer.play(false));
    const at = async (between, tick) => {
      await set(page, "between", between);
      // From the frame before, so that there are two.
      for (const time of [tick - 34, tick]) {
        await page.evaluate((time) => (viewer.tick = time), time);
        await fresh(page);
      }
      return page.evaluate(() => [...viewer.session.positions()]);
    };
    const distance = (one, other) => Math.max(...one.map((value, index) => Math.abs(value - other[index])));
    const [held, later] = [await at("0", 320), await at("0", 330)];
    assert.equal(distance(held, later), 0, "held within a frame");
    const [way, beyond] = [await at("1", 320), await at("2", 320)];
    assert(distance(held, way) > 0.01 && distance(held, beyond) > 0.01 && distance(way, beyond) > 0.01);
  },

  async "contacts have the surface's velocity"(page) {
    const speeds = async (between) => {
      await set(page, "margin", "20");
      await set(page, "between", between);
      await page.evaluate(() => {
        viewer.take([34, -40, 34, 92, -74, 74, 2.6]);
        viewer.play(true);
        viewer.tick = 300;
        for (let frame = 0; frame < 4; frame++) viewer.step(17);
      });
      const [contact] = await page.evaluate(() => viewer.touching.contacts);
      return { speed: Math.hypot(...contact.velocity), text: await shown(page, "speed") };
    };
    const moving = await speeds("1");
    assert(moving.speed > 1 && moving.text.startsWith(`${moving.speed.toFixed(1)} mm/s`), JSON.stringify(moving));
    const held = await speeds("0");
    assert(held.speed === 0 && held.text.startsWith("still"), JSON.stringify(held));
  },
};

async function replay(browser) {
  // Past the heart and into it, at 1 kHz.
  const lines = Array.from({ length: 400 }, (_, tick) => {
    const way = 110 - 0.2 * tick;
    return `capsule:${way},-20,40,${way + 70},-50,70,3`;
  });
  await writeFile(join(folder, "tools.csv"), lines.join("\n"));
  dibs("view", "heart.dibs", "--motion", "heart.pc2", "--path", "tools.csv", "-o", "replay.html");
  for (const [name, between] of [["held", "0"], ["interpolated", "1"], ["extrapolated", "2"]]) {
    const printed = dibs("track", "heart.dibs", "--motion", "heart.pc2", "--path", "tools.csv", "--surface", name, "--full", "--json");
    const track = printed.trim().split("\n").map((line) => JSON.parse(line));
    const page = await open(browser, "replay.html");
    const found = await page.evaluate((between) => {
      for (const [name, value] of [["between", between], ["search", "2"]]) viewer.controls.set(name, value);
      // The session of a new page has seen no frame.
      viewer.restart();
      const answers = [];
      for (let tick = 0; tick < 400; tick++) {
        viewer.advance(1);
        const [separation, lower] = viewer.session.answer();
        answers.push([separation, lower]);
      }
      return answers;
    }, between);
    found.forEach(([separation, lower], tick) => {
      assert.equal(separation, track[tick].separation, `${name}, tick ${tick}`);
      assert.equal(lower, track[tick].lower, `${name}, tick ${tick}`);
    });
    assert.deepEqual(page.complaints, []);
    await page.close();
  }
}

// A filter's record beside the path: the instrument goes where it was admitted, and the commanded one is seen.
async function filtered(browser) {
  const { admitted, commanded } = await recordedPath();
  dibs("view", "heart.dibs", "--motion", "heart.pc2", "--path", "commands.csv", "--ticks", "ticks.jsonl", "-o", "filtered.html");
  const page = await open(browser, "filtered.html", LARGE);
  const found = await page.evaluate((count) => {
    viewer.restart();
    return Array.from({ length: count }, () => {
      viewer.advance(1);
      return { pose: [...viewer.to], separation: viewer.session.answer()[0] };
    });
  }, 2 * admitted.length);
  found.forEach(({ pose, separation }, tick) => {
    // The second time the motion begins anew with the path.
    const { pose: expected, least } = admitted[tick % admitted.length];
    assert.deepEqual(pose.map(Math.fround), expected.map(Math.fround), `the admitted pose of tick ${tick}`);
    assert(separation > least - 0.01, `tick ${tick}: ${separation}, but the filter keeps ${least}`);
  });
  const short = admitted.findIndex(({ reason }) => reason !== "commanded");
  assert(short > 0, "the filter held nothing back");
  await page.evaluate((tick) => {
    viewer.restart();
    viewer.tick = tick - 1;
    viewer.to = viewer.facts.path[tick - 1];
    viewer.play(true);
    viewer.step(1);
    viewer.play(false);
  }, admitted.length - 1);
  const { reason, least, energy } = admitted.at(-1);
  const text = await shown(page, "filter");
  assert(text.startsWith(reason) && text.includes(`no nearer than ${least.toFixed(3)} mm`) && /[\d.]+ mm from the command/.test(text), text);
  assert.equal(await shown(page, "energy"), `${energy.toFixed(3)} mJ left`);
  const ghost = await page.evaluate(() => ({ isSeen: viewer.picture.commanded.visible, at: viewer.picture.commanded.balls[0].position.toArray() }));
  assert(ghost.isSeen, "the commanded instrument is drawn");
  assert.deepEqual(ghost.at.map(Math.fround), commanded.at(-1).slice(0, 3).map(Math.fround));
  const plots = await page.$$eval(".plot span", (titles) => titles.map((title) => title.textContent));
  assert(plots.includes("kept by the admitted motion") && plots.includes("energy left"), plots.join());
  await page.evaluate(() => {
    const { picture } = viewer;
    viewer.picture = null;
    viewer.restart();
    viewer.play(true);
    for (let tick = 0; tick < viewer.facts.path.length; tick++) viewer.step(1);
    viewer.play(false);
    viewer.picture = picture;
  });
  await fresh(page);
  await shot(page, "filtered");
  await page.evaluate(() => viewer.take([...viewer.to]));
  await fresh(page);
  assert(!(await page.evaluate(() => viewer.picture.commanded.visible)), "by hand nothing is commanded");
  assert.deepEqual(page.complaints, []);
  await page.close();
}

// A path into the heart, and what `dibs filter` makes of it, with an energy.
async function recordedPath() {
  const commanded = Array.from({ length: 400 }, (_, tick) => {
    const way = 90 - 0.15 * tick;
    return [way, -20, 40, way + 70, -50, 70, 3];
  });
  await writeFile(join(folder, "commands.csv"), commanded.map((pose) => `capsule:${pose}`).join("\n"));
  const printed = dibs("filter", "heart.dibs", "--motion", "heart.pc2", "--path", "commands.csv", "--stand-off", "1", "--json");
  const lines = printed.trim().split("\n").map((line, tick) => ({ ...JSON.parse(line), energy: 1 - tick / 1000 }));
  await writeFile(join(folder, "ticks.jsonl"), lines.map((line) => JSON.stringify(line)).join("\n"));
  const admitted = lines.map(({ admitted, reason, least_separation: least, energy }) => (
    { pose: admitted.replace("capsule:", "").split(",").map(Number), reason, least, energy }
  ));
  return { admitted, commanded };
}

// A tree whose surface nodes move: they are drawn where the session has them.
async function nodes(browser) {
  dibs("build", "heart.ply", "-o", "nodes.dibs", "--nodes", "lattice:6,6,7", "--stretch", "1.5");
  dibs("view", "nodes.dibs", "-o", "nodes.html");
  const page = await open(browser, "nodes.html", LARGE);
  await fresh(page);
  const { drawn, held, isSeen } = await page.evaluate(() => {
    const { dots } = viewer.picture;
    return { drawn: [...dots.geometry.attributes.position.array], held: [...viewer.session.nodes()], isSeen: dots.visible };
  });
  assert(isSeen && held.length > 300, `${held.length / 3} nodes`);
  assert.deepEqual(drawn, held);
  assert.match(await shown(page, "facts-line"), new RegExp(`moved by ${held.length / 3} nodes`));
  assert(!(await page.$eval("#legend .node", (part) => part.hidden)));
  await shot(page, "nodes");
  await page.click("input[name=nodes]");
  await fresh(page);
  assert(!(await page.evaluate(() => viewer.picture.dots.visible)), "a box hides them");
  assert.deepEqual(page.complaints, []);
  await page.close();
}

// The page of `cargo xtask demo`, if there is one: it plays the instrument of every tick. Returns a picture of the deepest.
async function demo(browser) {
  const lines = await readFile(join(DEMO, "tools.csv"), "utf8").catch(() => null);
  if (!lines) return null;
  const poses = lines.trim().split("\n").map((line) => line.replace("capsule:", "").split(",").map(Number));
  const { size } = await stat(join(DEMO, "replay.html"));
  assert(size <= MOST_BYTES, `the demo's page has ${size} bytes, more than ${MOST_BYTES}`);
  console.log(`the demo's page, ${poses.length} ticks: ${size} bytes`);
  const page = await open(browser, join(DEMO, "replay.html"), LARGE);
  const found = await page.evaluate((count) => {
    viewer.restart();
    const ticks = [];
    for (let tick = 0; tick < count; tick++) {
      viewer.advance(1);
      ticks.push({ pose: [...viewer.to], separation: viewer.session.answer()[0] });
    }
    return ticks;
  }, poses.length);
  for (const [tick, { pose }] of found.entries()) {
    assert.deepEqual(pose.map(Math.fround), poses[tick].map(Math.fround), `tick ${tick} of the demo`);
  }
  const depths = found.map(({ separation }) => separation);
  const deepest = depths.indexOf(Math.min(...depths));
  assert(depths[deepest] < 0, `the demo's instrument crosses the wall: ${depths[deepest]}`);
  await page.evaluate((ticks) => {
    viewer.play(true);
    viewer.restart();
    const { picture } = viewer;
    viewer.picture = null;
    for (let tick = 0; tick < ticks; tick += 17) viewer.step(Math.min(17, ticks - tick));
    viewer.picture = picture;
    viewer.play(false);
  }, deepest + 1);
  await set(page, "opacity", "0.5");
  await fresh(page);
  const path = join(pictures, "replay.jpg");
  await page.screenshot({ path, type: "jpeg", quality: 82 });
  await shot(page, "replay");
  assert.deepEqual(page.complaints, []);
  await page.close();
  return path;
}

async function touches(browser) {
  const page = await open(browser, "heart.html", { width: 420, height: 800, hasTouch: true });
  await page.evaluate(() => viewer.play(false));
  await fresh(page);
  const before = await pose(page);
  const { x, y } = await page.evaluate(() => {
    const [start, end] = viewer.picture.tool.balls.map((ball) => viewer.hand.seen(ball.position));
    return start.lerp(end, 0.5);
  });
  const finger = await page.touchscreen.touchStart(x, y);
  await finger.move(x - 30, y + 20);
  await finger.end();
  assert.notDeepEqual(await pose(page), before, "a finger drags the instrument");
  await fresh(page);
  await shot(page, "narrow");
  assert.deepEqual(page.complaints, []);
  await page.close();
}

async function withoutWebGl() {
  const browser = await launch(["--disable-gpu", "--disable-3d-apis"]);
  const page = await open(browser, "heart.html");
  assert.match(await shown(page, "message"), /no WebGL/);
  const { separation } = await record(page);
  await page.focus("#view");
  for (let step = 0; step < 5; step++) await page.keyboard.press("ArrowRight");
  await page.evaluate(() => viewer.play(false));
  assert.notEqual((await record(page)).separation, separation, "keys and the query work");
  await shot(page, "no-webgl");
  await browser.close();
}

// Frame time and time a tick while the heart beats, as the page itself measures them.
async function measure(browser) {
  const page = await open(browser, "heart.html", { ...LARGE, runs: true });
  const measured = await page.evaluate(async () => {
    const next = () => new Promise(requestAnimationFrame);
    for (let frame = 0; frame < 3; frame++) await next();
    const start = performance.now();
    for (let frame = 0; frame < 10; frame++) await next();
    const frame = (performance.now() - start) / 10;
    viewer.frame = () => {};
    // In turns of a frame, as a running page asks.
    const tick = (search) => {
      viewer.controls.set("search", search);
      let milliseconds = 0;
      for (let turn = 0; turn < 300; turn++) milliseconds += viewer.advance(17).milliseconds;
      return (milliseconds / 300 / 17) * 1000;
    };
    const ticks = { tracker: tick("0"), warm: tick("1"), cold: tick("2") };
    viewer.controls.set("search", "0");
    const { renderer } = viewer.picture;
    const step = (frames) => {
      const before = performance.now();
      for (let frame = 0; frame < frames; frame++) viewer.step(17);
      return (performance.now() - before) / frames;
    };
    const { render } = renderer;
    renderer.render = () => {};
    step(10);
    const work = step(60);
    renderer.render = render;
    // The commands of a frame go to another process, which draws while this one goes on: of a few frames in a row none waits.
    step(1);
    await new Promise((done) => setTimeout(done, 3000));
    return { frame, ticks, work, commands: Math.max(step(3) - work, 0) };
  });
  await page.close();
  return measured;
}

async function scenes(browser) {
  const page = await open(browser, "heart.html", LARGE);
  await page.evaluate(() => {
    viewer.play(false);
    viewer.tick = 340;
    viewer.take([34, -40, 34, 92, -74, 74, 2.6]);
  });
  await set(page, "margin", "12");
  await page.evaluate(() => {
    viewer.play(true);
    // The picture is drawn later: plots need the ticks alone.
    const { picture } = viewer;
    viewer.picture = null;
    for (let frame = 0; frame < 320; frame++) viewer.step(17);
    viewer.picture = picture;
    viewer.play(false);
  });
  const views = { outside: {}, level: { spheres: "level" }, tested: { spheres: "tested", opacity: "0.5" }, front: { spheres: "front" } };
  for (const [name, settings] of Object.entries(views)) {
    for (const [key, value] of Object.entries({ spheres: "none", opacity: "1", ...settings })) await set(page, key, value);
    await fresh(page);
    await shot(page, name);
    if (name === "front") await page.screenshot({ path: PICTURE, type: "jpeg", quality: 82 });
  }
  await set(page, "spheres", "none");
  await page.evaluate(() => viewer.take([20, -20, 34, 92, -74, 74, 2.6]));
  await set(page, "opacity", "0.6");
  await fresh(page);
  await shot(page, "crossing");
  await page.close();
}

dibs("view", TREE, "--motion", "heart.pc2", "-o", "heart.html");
const { size } = await stat(join(folder, "heart.html"));
assert(size <= 3e6, `heart.html has ${size} bytes`);
const browser = await launch(SOFTWARE_GL);
try {
  for (const [name, check] of Object.entries(checks)) {
    const page = await open(browser, "heart.html");
    await check(page);
    assert.deepEqual(page.complaints, [], name);
    await page.close();
    console.log(`passed: ${name}`);
  }
  await touches(browser);
  console.log("passed: a finger");
  await replay(browser);
  console.log("passed: a replay has the separations of `dibs track`");
  await filtered(browser);
  console.log("passed: commanded and admitted poses, the separation kept, the energy");
  await nodes(browser);
  console.log("passed: nodes");
  const run = await demo(browser);
  console.log(run ? "passed: the demo's run has its instrument at every tick" : "skipped: no run of `cargo xtask demo`");
  await withoutWebGl();
  console.log("passed: without WebGL the page says so, and answers");
  await scenes(browser);
  const measured = { size, version: await browser.version(), ...(await measure(browser)) };
  console.log(measured);
  if (process.argv.includes("--record")) await recordPage(measured, [PICTURE, ...(run ? [run] : [])]);
} finally {
  await browser.close();
}
