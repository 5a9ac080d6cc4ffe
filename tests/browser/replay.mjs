// Plays a real run's page in a real browser and compares what it shows with the trace.
//
// Responsible for: driving headless Chromium over its debugging pipe (Node.js, no packages), and
// the comparisons. What is expected comes from elsewhere than the page's script: positions from the
// `state` records of the trace, which the page does not use for them, read here from the MCAP
// file; homes, goals and walls from its `scene` record.
// Usage: node replay.mjs REPLAY.html RUN.mcap [SCREENSHOT_DIRECTORY]; CHROMIUM names the browser.

import { spawn } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import assert from "node:assert/strict";

const [page, trace, pictures] = process.argv.slice(2);

// --- the trace, read by itself ----------------------------------------------------------------

/** All records of a topic. Chunks are not compressed. */
function messages(bytes, wanted) {
  const channels = new Map(), found = [];
  const walk = (from, to) => {
    for (let at = from; at < to; ) {
      const op = bytes[at], length = Number(bytes.readBigUInt64LE(at + 1)), body = at + 9;
      if (op === 0x04) {
        const size = bytes.readUInt32LE(body + 4);
        channels.set(bytes.readUInt16LE(body), bytes.toString("utf8", body + 8, body + 8 + size));
      } else if (op === 0x05 && channels.get(bytes.readUInt16LE(body)) === wanted) {
        found.push(JSON.parse(bytes.toString("utf8", body + 22, body + length)));
      } else if (op === 0x06) {
        const name = bytes.readUInt32LE(body + 28), records = body + 32 + name;
        walk(records + 8, records + 8 + Number(bytes.readBigUInt64LE(records)));
      }
      at = body + length;
    }
  };
  walk(8, bytes.length - 8);
  return found;
}

const bytes = readFileSync(trace);
const [scene] = messages(bytes, "scene"), states = messages(bytes, "state"), [end] = messages(bytes, "end");

// --- the browser ------------------------------------------------------------------------------

const profile = mkdtempSync(join(tmpdir(), "rearrange-browser-"));
const browser = spawn(process.env.CHROMIUM ?? "chromium", [
  "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--no-first-run", "--remote-debugging-pipe",
  `--user-data-dir=${profile}`, "--window-size=1400,1000", "about:blank",
], { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"] });
const [, , , toBrowser, fromBrowser] = browser.stdio;
const gone = new Promise((leave) => browser.once("exit", leave));
const watchdog = setTimeout(() => {
  console.error("the browser has not answered for two minutes");
  browser.kill("SIGKILL");
  process.exit(1);
}, 120_000);
browser.once("error", (error) => { console.error(`no browser: ${error.message}`); process.exit(1); });

const pending = new Map(), heard = [];
let buffer = "", id = 0;
fromBrowser.setEncoding("utf8").on("data", (data) => {
  buffer += data;
  const parts = buffer.split("\0");
  buffer = parts.pop();
  for (const message of parts.map((part) => JSON.parse(part))) {
    if (message.id === undefined) { heard.push(message); continue; }
    const { done, fail } = pending.get(message.id);
    pending.delete(message.id);
    if (message.error) fail(new Error(message.error.message)); else done(message.result);
  }
});

let session;
function call(method, params = {}) {
  id += 1;
  toBrowser.write(JSON.stringify({ id, method, params, sessionId: session }) + "\0");
  return new Promise((done, fail) => pending.set(id, { done, fail }));
}

async function ask(expression) {
  const { result, exceptionDetails } = await call("Runtime.evaluate", { expression, returnByValue: true, awaitPromise: true });
  assert.equal(exceptionDetails, undefined, `${expression}: ${exceptionDetails?.exception?.description}`);
  return result.value;
}

const wait = (ms) => new Promise((done) => setTimeout(done, ms));

async function key(name, text) {
  await call("Input.dispatchKeyEvent", { type: "keyDown", key: name, text });
  await call("Input.dispatchKeyEvent", { type: "keyUp", key: name });
}

async function look(name, { dark = false, width = 1400, height = 1000 } = {}) {
  await call("Emulation.setDeviceMetricsOverride", { width, height, deviceScaleFactor: 1, mobile: false });
  await call("Emulation.setEmulatedMedia", { features: [{ name: "prefers-color-scheme", value: dark ? "dark" : "light" }] });
  await wait(200);
  if (!pictures) return;
  const { data } = await call("Page.captureScreenshot", { format: "png" });
  writeFileSync(join(pictures, `${name}.png`), Buffer.from(data, "base64"));
}

// --- the comparisons --------------------------------------------------------------------------

const NANOMETRE = 2e-9;

function near(shown, told, what, within = NANOMETRE) {
  const off = Math.hypot(shown[0] - told.x, shown[1] - told.y);
  assert.ok(off <= within, `${what} is shown at ${shown}, but the trace says ${told.x}, ${told.y}`);
}

async function compareStates() {
  const step = Math.max(1, Math.floor(states.length / 60));
  let moved = 0, carried = 0, granted = 0;
  for (const state of states.filter((_, i) => i % step === 0)) {
    const shown = await ask(`replay.seek(${state.time_ns} / 1e9), { robots: replay.robots(), objects: replay.objects() }`);
    state.robots.forEach((robot, i) => {
      const now = shown.robots[i], when = `robot ${i} at ${state.time_ns} ns`;
      near(now.at, robot.at, when);
      assert.equal(now.phase, robot.phase, when);
      assert.equal(now.activity, robot.activity, when);
      assert.deepEqual(now.grant.length, (robot.grant ?? []).length, `${when}: corners granted`);
      granted += now.grant.length > 0;
      moved += Math.hypot(robot.at.x - scene.homes[i].x, robot.at.y - scene.homes[i].y) > 0.1;
    });
    state.objects.forEach((object, i) => {
      near(shown.objects[i].at, object.at, `object ${i} at ${state.time_ns} ns`);
      if (object.holder === null) return;
      carried += 1;
      assert.equal(shown.objects[i].robot, object.holder, `who holds object ${i} at ${state.time_ns} ns`);
    });
  }
  assert.ok(moved > 0 && carried > 0 && granted > 0, "the states compared show robots that move, carry and are granted way");
  console.log(`positions, phases, grants and holders agree with ${Math.ceil(states.length / step)} states of the trace`);
}

async function compareEnds() {
  const still = (shown, places, what) => places.forEach((place, i) => place && near(shown[i].at, place, `${what} ${i}`));
  await key("Home");
  assert.equal(await ask("replay.time()"), 0);
  still(await ask("replay.robots()"), scene.homes, "robot");
  still(await ask("replay.objects()"), scene.objects.map((object) => object.start), "object");
  await key("End");
  assert.equal(await ask("replay.time()"), end.makespan_ns / 1e9);
  assert.equal(end.outcome, "solved");
  still(await ask("replay.robots()"), scene.homes, "robot");
  still(await ask("replay.objects()"), scene.objects.map((object) => object.goal), "object");
  assert.equal(await ask("replay.unmet().length"), 0, "constraints unmet at the end");
  console.log("at the start all stand at their starts, at the end at homes and goals");
}

/**
 * The colours of the canvas by place in the room. Which pixel is which place follows from the
 * outermost pixels that are painted as wall: the frame, 5 px wide around the room.
 */
async function picture(wall) {
  const { width, height, pixels } = await ask(`(() => { const c = document.getElementById("room");
    const all = c.getContext("2d").getImageData(0, 0, c.width, c.height).data;
    return { width: c.width, height: c.height, pixels: btoa(Array.from(all, (v) => String.fromCharCode(v)).join("")) }; })()`);
  const bytes = Buffer.from(pixels, "base64");
  const colour = (x, y) => [...bytes.subarray(4 * (y * width + x), 4 * (y * width + x) + 3)];
  let [left, right, top, bottom] = [Infinity, -1, Infinity, -1];
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      if (colour(x, y).some((value, k) => value !== wall[k])) continue;
      [left, right, top, bottom] = [Math.min(left, x), Math.max(right, x), Math.min(top, y), Math.max(bottom, y)];
    }
  }
  const frame = 5, x0 = left + frame, y0 = top + frame;
  const scale = [(right + 1 - frame - x0) / (scene.high.x - scene.low.x), (bottom + 1 - frame - y0) / (scene.high.y - scene.low.y)];
  assert.ok(scale[0] > 10 && Math.abs(scale[0] / scale[1] - 1) < 0.02, `the room is painted ${scale} px a metre`);
  return (x, y) => colour(Math.round(x0 + (x - scene.low.x) * scale[0]), Math.round(y0 + (scene.high.y - y) * scale[1]));
}

/** What is painted where the trace says something is: off the middle, where the number is. */
async function comparePicture() {
  const name = (colour) => ask(`(() => { const c = document.createElement("canvas").getContext("2d");
    c.fillStyle = getComputedStyle(document.documentElement).getPropertyValue("--${colour}"); c.fillRect(0, 0, 1, 1);
    return [...c.getImageData(0, 0, 1, 1).data].slice(0, 3); })()`);
  const wall = await name("wall");
  let painted;
  const paint = async () => { painted = await picture(wall); };
  const at = (x, y) => painted(x, y);
  await paint();
  for (const { shape, at: place } of scene.walls) assert.deepEqual(at(place.x, place.y), wall, "a wall");
  const state = states.find((state) => state.robots.some((robot) => robot.phase === "transfer" && robot.activity === "moving"));
  await ask(`replay.seek(${state.time_ns} / 1e9)`);
  await paint();
  const corner = (half) => 0.8 * half.x;
  for (const [i, robot] of state.robots.entries()) {
    const d = corner(scene.robot.shape.box.half);
    assert.deepEqual(at(robot.at.x - d, robot.at.y + d), await name(robot.phase), `robot ${i} is painted as ${robot.phase}`);
  }
  for (const [i, object] of state.objects.entries()) {
    const d = corner(scene.objects[i].shape.box.half);
    const kind = object.status === "done" ? "done" : "object";
    assert.deepEqual(at(object.at.x - d, object.at.y + d), await name(kind), `object ${i} is painted as ${kind}`);
  }
  console.log(`${scene.walls.length} walls, ${state.robots.length} robots and ${state.objects.length} objects are painted where the trace says`);
}

async function play() {
  await key("Home");
  await ask(`document.getElementById("speed").value = "8", document.getElementById("speed").dispatchEvent(new Event("change"))`);
  await key(" ", " ");
  assert.equal(await ask("replay.playing()"), true, "space plays");
  const before = await ask("replay.time()");
  for (let i = 0; i < 100 && (await ask("replay.time()")) < before + 1; i++) await wait(50);
  assert.ok((await ask("replay.time()")) >= before + 1, "time goes on while it plays");
  await key(" ", " ");
  assert.equal(await ask("replay.playing()"), false, "space pauses");
  const paused = await ask("replay.time()");
  await wait(200);
  assert.equal(await ask("replay.time()"), paused, "time stands while it is paused");
  await ask(`document.getElementById("scrub").value = "5", document.getElementById("scrub").dispatchEvent(new Event("input"))`);
  assert.equal(await ask("replay.time()"), 5, "the slider sets the time");
  await key("ArrowRight");
  assert.equal(await ask("replay.time()"), 6, "an arrow key goes a second further");
  assert.match(await ask(`document.getElementById("clock").textContent`), /^6\.00 s/);
  await ask(`document.getElementById("play").click()`);
  assert.equal(await ask("replay.playing()"), true, "the button plays");
  await ask("replay.seek(1e9)");
  for (let i = 0; i < 100 && (await ask("replay.playing()")); i++) await wait(50);
  assert.equal(await ask("replay.playing()"), false, "it stops at the end");
  console.log("plays, pauses, scrubs and steps by mouse and keys");
}

function hearNothingBad() {
  const bad = heard.filter(({ method, params }) => method === "Runtime.exceptionThrown" || (method === "Log.entryAdded" && params.entry.level === "error"));
  assert.deepEqual(bad, [], "errors on the page");
  const requested = heard.filter(({ method }) => method === "Network.requestWillBeSent").map(({ params }) => params.request.url);
  assert.deepEqual(requested.filter((url) => !url.startsWith("file:")), [], "the page asks for nothing from elsewhere");
  assert.ok(requested.length > 0, "requests are heard of at all");
  console.log("no error, and no request but for the page itself");
}

async function main() {
  const { targetInfos } = await call("Target.getTargets");
  const target = targetInfos.find(({ type }) => type === "page").targetId;
  ({ sessionId: session } = await call("Target.attachToTarget", { targetId: target, flatten: true }));
  for (const domain of ["Runtime", "Log", "Network", "Page"]) await call(`${domain}.enable`);
  await call("Page.navigate", { url: pathToFileURL(resolve(page)).href });
  for (let i = 0; i < 200 && !(await ask("Boolean(window.replay)")); i++) await wait(50);
  await look("light");
  await compareStates();
  await compareEnds();
  await comparePicture();
  await look("light-middle");
  await look("dark", { dark: true });
  await comparePicture();
  await look("narrow", { width: 420, height: 1500 });
  assert.ok(await ask("document.documentElement.scrollWidth <= innerWidth"), "nothing is wider than a narrow window");
  await look("light");
  await play();
  hearNothingBad();
}

let failure;
try {
  await main();
} catch (error) {
  failure = error;
}
clearTimeout(watchdog);
browser.kill();
await gone;
rmSync(profile, { recursive: true, force: true, maxRetries: 5 });
if (failure) {
  console.error(`FAILED: ${failure.message}`);
  process.exit(1);
}
