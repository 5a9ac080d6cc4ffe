// Plays a run: reads the data that `page.rs` put beside it, draws the room, keeps the panels.
// Responsible for: everything that happens on the page. It loads nothing and sends nothing.
// Terms: times are ns as in the trace, places metres with y upwards, as in the trace.
// `window.replay` at the end is for tests and the console.
"use strict";
(() => {
const data = JSON.parse(document.getElementById("data").textContent);
const $ = (id) => document.getElementById(id);
const UNTIL = Math.max(data.until, 1);
const SPEEDS = [0.25, 0.5, 1, 2, 4, 8, 16, 32, 64];
const TRAIL_NS = 6e9;
const PIECE = 6; // numbers a piece of motion has: start, end, from x, y, to x, y

// --- what is so when ------------------------------------------------------------------------------

/** Index of the last of `count` entries whose `time(i)` is not after `t`; -1 before the first. */
function last(count, time, t) {
  let low = 0, high = count;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (time(middle) <= t) low = middle + 1; else high = middle;
  }
  return low - 1;
}

/** Where a body is: on its piece of motion at `t`, or where the last one ended. Exact. */
function placeAt(track, start, t) {
  const k = PIECE * last(track.length / PIECE, (i) => track[PIECE * i], t);
  if (k < 0) return start;
  const part = t >= track[k + 1] ? 1 : (t - track[k]) / (track[k + 1] - track[k]);
  return [track[k + 2] + (track[k + 4] - track[k + 2]) * part, track[k + 3] + (track[k + 5] - track[k + 3]) * part];
}

/** Corners of a body's way between two times, with where it is at both. */
function wayOf(track, start, from, to) {
  const corners = [placeAt(track, start, from)];
  const n = track.length / PIECE;
  for (let i = Math.max(0, last(n, (j) => track[PIECE * j], from)); i < n && track[PIECE * i] < to; i++) {
    const k = PIECE * i;
    if (track[k] > from) corners.push([track[k + 2], track[k + 3]]);
    if (track[k + 1] > from && track[k + 1] < to) corners.push([track[k + 4], track[k + 5]]);
  }
  corners.push(placeAt(track, start, to));
  return corners;
}

/** Length of a way, m. */
function lengthOf(corners) {
  let sum = 0;
  for (let i = 1; i < corners.length; i++) sum += Math.hypot(corners[i][0] - corners[i - 1][0], corners[i][1] - corners[i - 1][1]);
  return sum;
}

function entryAt(timeline, t) {
  const i = last(timeline.length, (j) => timeline[j][0], t);
  return i < 0 ? null : timeline[i];
}

const robotAt = (i, t) => placeAt(data.robots[i].track, data.homes[i], t);
const objectAt = (i, t) => placeAt(data.objects[i].track, data.things[i].start, t);
/** Walls and goals as they are at a time: the scene may change. */
const versionAt = (t) => entryAt(data.versions, t)[1];
const goalAt = (i, t) => versionAt(t).goals[i] ?? null;
/** Objects and robots may come later. */
const isThere = (i, t) => t >= data.objects[i].since;
const hasRobot = (i, t) => t >= data.robots[i].since;

/** Closing and opening a grip look alike. */
const kindOf = (phase) => (phase === "grasping" || phase === "releasing" ? "gripping" : phase);

function robotDoing(i, t) {
  const entry = entryAt(data.robots[i].doing, t);
  const [phase, activity, task, holding] = entry ? entry[1] : ["idle", "idle", null, null];
  const wait = entryAt(data.robots[i].waits, t)?.[1] ?? null;
  return { phase, activity, task, holding, wait, kind: kindOf(phase) };
}

function taskDoing(i, t) {
  const [status, robot] = (entryAt(data.objects[i].doing, t) ?? data.objects[i].doing[0])[1];
  return { status, robot };
}

/** The object each robot carries, by robot; exact to the event. */
function carriedAt(t) {
  const carried = new Map();
  data.objects.forEach((_, i) => {
    const { status, robot } = taskDoing(i, t);
    if (status === "held" && robot != null) carried.set(robot, i);
  });
  return carried;
}

/** The granted way still ahead: corners of the last state, less those passed since. */
function grantAt(i, t) {
  const entry = entryAt(data.robots[i].grants, t);
  if (!entry || entry[1].length === 0) return [];
  const walked = lengthOf(wayOf(data.robots[i].track, data.homes[i], entry[0], t));
  const way = [robotAt(i, entry[0]), ...entry[1]];
  let done = 0, k = 1;
  while (k < way.length) {
    done += Math.hypot(way[k][0] - way[k - 1][0], way[k][1] - way[k - 1][1]);
    if (done > walked + 1e-6) break;
    k++;
  }
  return way.slice(k);
}

const completedAt = data.objects.map((object) => {
  const entry = object.doing.find(([, [status]]) => status === "done");
  return entry ? entry[0] : Infinity;
});

/** Constraints known and not met yet: [before, after, kinds]. */
function unmetAt(t) {
  const pairs = new Map();
  for (const [before, after, kind, since] of data.constraints) {
    if (since > t || completedAt[before] <= t || completedAt[after] <= t) continue;
    const key = before * data.things.length + after;
    const kinds = pairs.get(key);
    if (!kinds) pairs.set(key, [kind]); else if (!kinds.includes(kind)) kinds.push(kind);
  }
  return [...pairs].map(([key, kinds]) => [Math.floor(key / data.things.length), key % data.things.length, kinds]);
}

// --- words ----------------------------------------------------------------------------------------

const KINDS = {
  idle: "at home, no task", selecting: "selects a task", transit: "on its way to grasp",
  gripping: "grasps or releases", transfer: "carries", failing: "reports a failure", going_home: "goes home",
};
const PHASES = { ...KINDS, grasping: "grasps", releasing: "releases", idle: "has no task" };
const ACTIVITIES = { waiting: "waits", computing: "computes" };
const STATUSES = { waiting: "waits", claimed: "claimed by", held: "carried by", done: "done" };

const seconds = (t, digits = 2) => (t / 1e9).toFixed(digits);

function sentence(event) {
  const { robot, task } = event;
  switch (event.event) {
    case "started": return "the run begins";
    case "claimed": return `robot ${robot} claims task ${task}`;
    case "unclaimed": return `robot ${robot} gives task ${task} back`;
    case "grasped": return `robot ${robot} grasps object ${task}`;
    case "released": return `robot ${robot} puts object ${task} down`;
    case "completed": return `task ${task} is completed`;
    case "failed":
      return `task ${task} fails for robot ${robot}: ` + (event.cause === "robots"
        ? (event.blocker == null ? "robots in the way" : `robot ${event.blocker} in the way`) : "objects in the way");
    case "constraint": return `hard constraint ${event.test.toUpperCase()}: ${event.before} before ${event.after}`;
    case "robot_up": return `robot ${robot} takes part again`;
    case "robot_down": return `robot ${robot} is gone`;
    case "held": return "all motion is held";
    case "resumed": return "motion goes on";
    case "ended": return `the run ends: ${event.outcome}`;
    case "changed": return `the scene changes (version ${event.version})`;
    case "moved": return `somebody moves object ${task}`;
    case "schedule_refused": return `version ${event.version} of the plan is refused (${event.why})`;
    case "violated": return `the world reports a broken invariant (${event.invariant})`;
    default: return event.event;
  }
}

function waitsFor(doing) {
  if (doing.activity === "waiting") return doing.wait ? doing.wait.join(" ") : "a free way";
  if (doing.activity === "computing") return doing.phase === "failing" ? "the planner" : "its own planning";
  return "";
}

// --- the room -------------------------------------------------------------------------------------

const canvas = $("room"), ctx = canvas.getContext("2d");
const view = { scale: 1, x: 0, y: 0, zoom: 1, centre: null, width: 0, height: 0, ratio: 1 };
let colours = {};

const NAMES = ["card", "line", "ink", "dim", "floor", "grid", "wall", "object", "object-line", "object-ink", "done", "done-line",
  "done-ink", "goal", "home", "robot-ink", "idle", "selecting", "transit", "gripping", "transfer", "failing", "going_home", "waiting", "computing"];

function readColours() {
  const style = getComputedStyle(document.documentElement);
  colours = Object.fromEntries(NAMES.map((name) => [name, style.getPropertyValue("--" + name).trim()]));
}

const size = [data.high[0] - data.low[0], data.high[1] - data.low[1]];

function layOut() {
  const width = $("stage").clientWidth;
  const margin = 14;
  const most = Math.max(260, Math.min(window.innerHeight * 0.66, 900));
  const scale = Math.min((width - 2 * margin) / size[0], (most - 2 * margin) / size[1]);
  view.width = width;
  view.height = Math.round(size[1] * scale + 2 * margin);
  view.ratio = window.devicePixelRatio || 1;
  canvas.style.height = view.height + "px";
  canvas.width = Math.round(view.width * view.ratio);
  canvas.height = Math.round(view.height * view.ratio);
  view.fit = scale;
  place();
}

/** Keeps the middle of the view within the room. */
function place() {
  const middle = [data.low[0] + size[0] / 2, data.low[1] + size[1] / 2];
  const centre = view.zoom === 1 || !view.centre ? middle : view.centre;
  view.centre = centre.map((c, k) => Math.min(Math.max(c, data.low[k]), data.high[k]));
  view.scale = view.fit * view.zoom;
  view.x = view.width / 2 - view.centre[0] * view.scale;
  view.y = view.height / 2 + view.centre[1] * view.scale;
  canvas.classList.toggle("zoomed", view.zoom > 1);
}

const px = (p) => [view.x + p[0] * view.scale, view.y - p[1] * view.scale];

function corners(shape, at) {
  return shape.p.map(([x, y]) => px([at[0] + x, at[1] + y]));
}

function polygon(points) {
  points.forEach(([x, y], i) => (i ? ctx.lineTo(x, y) : ctx.moveTo(x, y)));
  ctx.closePath();
}

/** Adds a body's outline to the path; `inset` pixels smaller, so that lines stay inside of it. */
function outline(shape, at, inset = 0) {
  const [x, y] = px(at);
  if (shape.r !== undefined) {
    const r = Math.max(0.5, shape.r * view.scale - inset);
    ctx.moveTo(x + r, y);
    ctx.arc(x, y, r, 0, 2 * Math.PI);
    return;
  }
  const reach = extent(shape) * view.scale;
  const shrink = inset ? Math.max(0.2, (reach - inset) / reach) : 1;
  polygon(corners(shape, at).map(([a, b]) => [x + (a - x) * shrink, y + (b - y) * shrink]));
}

/** Half of the smaller width of a shape, m. */
function extent(shape) {
  if (shape.r !== undefined) return shape.r;
  if (!shape.half) {
    const xs = shape.p.map((p) => p[0]), ys = shape.p.map((p) => p[1]);
    shape.half = Math.min(Math.max(...xs) - Math.min(...xs), Math.max(...ys) - Math.min(...ys)) / 2;
  }
  return shape.half;
}

function hull(points) {
  points.sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const chain = (list) => {
    const out = [];
    for (const p of list) {
      while (out.length > 1 && (out.at(-1)[0] - out.at(-2)[0]) * (p[1] - out.at(-2)[1]) <= (out.at(-1)[1] - out.at(-2)[1]) * (p[0] - out.at(-2)[0])) out.pop();
      out.push(p);
    }
    out.pop();
    return out;
  };
  return [...chain(points), ...chain(points.slice().reverse())];
}

/** Adds what a shape covers along a way. */
function sweep(shape, way, offset) {
  const round = Array.from({ length: 24 }, (_, i) => [Math.cos(i * Math.PI / 12), Math.sin(i * Math.PI / 12)]);
  const points = shape.p || round.map(([x, y]) => [x * shape.r, y * shape.r]);
  for (let i = 1; i < way.length; i++) {
    const ends = [way[i - 1], way[i]];
    polygon(hull(ends.flatMap((end) => points.map(([x, y]) => px([end[0] + offset[0] + x, end[1] + offset[1] + y])))));
  }
}

function label(text, at, shape, colour, weight = 650) {
  const room = extent(shape) * view.scale;
  const points = Math.min(room * 1.05, 22);
  if (points < 7) return;
  const [x, y] = px(at);
  ctx.font = `${weight} ${text.length > 2 ? points * 0.75 : points}px system-ui, sans-serif`;
  ctx.textAlign = "center";
  ctx.textBaseline = "middle";
  ctx.fillStyle = colour;
  ctx.fillText(text, x, y + points * 0.06);
}

function line(points, width, colour, alpha = 1, dash = []) {
  ctx.beginPath();
  points.forEach((p, i) => { const [x, y] = px(p); if (i) ctx.lineTo(x, y); else ctx.moveTo(x, y); });
  ctx.lineWidth = width;
  ctx.setLineDash(dash);
  ctx.strokeStyle = colour;
  ctx.globalAlpha = alpha;
  ctx.lineJoin = ctx.lineCap = "round";
  ctx.stroke();
  ctx.globalAlpha = 1;
  ctx.setLineDash([]);
}

function drawFloor() {
  const [x0, y1] = px(data.low), [x1, y0] = px(data.high);
  ctx.fillStyle = colours.floor;
  ctx.fillRect(x0, y0, x1 - x0, y1 - y0);
  if (view.scale > 14) {
    ctx.beginPath();
    for (let x = Math.ceil(data.low[0]); x < data.high[0]; x++) { const [a] = px([x, 0]); ctx.moveTo(a, y0); ctx.lineTo(a, y1); }
    for (let y = Math.ceil(data.low[1]); y < data.high[1]; y++) { const [, b] = px([0, y]); ctx.moveTo(x0, b); ctx.lineTo(x1, b); }
    ctx.lineWidth = 1;
    ctx.strokeStyle = colours.grid;
    ctx.stroke();
  }
}

function drawWalls(t) {
  ctx.beginPath();
  for (const wall of versionAt(t).walls) outline(wall.shape, wall.at);
  ctx.fillStyle = colours.wall;
  ctx.fill();
  const [x0, y1] = px(data.low), [x1, y0] = px(data.high);
  ctx.lineWidth = 5;
  ctx.strokeStyle = colours.wall;
  ctx.strokeRect(x0 - 2.5, y0 - 2.5, x1 - x0 + 5, y1 - y0 + 5);
}

function drawPlaces(t) {
  ctx.lineWidth = 1.25;
  ctx.setLineDash([2, 3]);
  ctx.strokeStyle = colours.home;
  ctx.beginPath();
  data.homes.forEach((home, i) => { if (hasRobot(i, t)) outline(data.robot, home, 1); });
  ctx.stroke();
  ctx.setLineDash([5, 4]);
  ctx.lineWidth = 1.75;
  ctx.strokeStyle = colours.goal;
  ctx.beginPath();
  const open = data.things.flatMap((thing, i) => {
    const goal = goalAt(i, t);
    return goal && taskDoing(i, t).status !== "done" ? [[thing, i, goal]] : [];
  });
  for (const [thing, , goal] of open) outline(thing.shape, goal, 1);
  ctx.stroke();
  ctx.setLineDash([]);
  for (const [thing, i, goal] of open) label(String(i), goal, thing.shape, colours.goal, 450);
}

function drawWays(t) {
  data.things.forEach((_, i) => {
    const goal = goalAt(i, t);
    if (goal && taskDoing(i, t).status !== "done") line([objectAt(i, t), goal], 1.25, colours.goal, 0.7, [2, 4]);
  });
}

function drawTrails(t) {
  for (let i = 0; i < data.robots.length; i++) {
    const way = wayOf(data.robots[i].track, data.homes[i], Math.max(0, t - TRAIL_NS), t);
    line(way, Math.max(1.5, Math.min(4, extent(data.robot) * view.scale * 0.16)), colours[robotDoing(i, t).kind], 0.45);
  }
}

function drawGrants(t, carried) {
  for (let i = 0; i < data.robots.length; i++) {
    const ahead = grantAt(i, t);
    if (ahead.length === 0) continue;
    const at = robotAt(i, t), way = [at, ...ahead];
    const doing = robotDoing(i, t);
    ctx.beginPath();
    sweep(data.robot, way, [0, 0]);
    const held = carried.get(i);
    if (held !== undefined) {
      const there = objectAt(held, t);
      sweep(data.things[held].shape, way, [there[0] - at[0], there[1] - at[1]]);
    }
    ctx.fillStyle = colours[doing.kind];
    ctx.globalAlpha = 0.3;
    ctx.fill();
    ctx.globalAlpha = 1;
  }
}

function drawObjects(t) {
  data.things.forEach((thing, i) => {
    if (!isThere(i, t)) return;
    const at = objectAt(i, t), { status, robot } = taskDoing(i, t);
    const name = status === "done" && goalAt(i, t) ? "done" : "object";
    ctx.beginPath();
    outline(thing.shape, at, 1);
    ctx.fillStyle = colours[name];
    ctx.fill();
    ctx.lineWidth = status === "held" ? 2.5 : 1.5;
    ctx.strokeStyle = status === "held" && robot != null ? colours[robotDoing(robot, t).kind] : colours[name + "-line"];
    ctx.stroke();
    label(String(i), at, thing.shape, colours[name + "-ink"]);
  });
}

function drawRobots(t, carried) {
  for (let i = 0; i < data.robots.length; i++) {
    if (!hasRobot(i, t)) continue;
    const at = robotAt(i, t), doing = robotDoing(i, t);
    const held = carried.get(i);
    const lifted = held !== undefined && overlaps(at, objectAt(held, t), held);
    ctx.beginPath();
    outline(data.robot, at, 0.5);
    ctx.fillStyle = colours[doing.kind];
    ctx.globalAlpha = lifted ? 0.35 : 1;
    ctx.fill();
    ctx.globalAlpha = 1;
    if (lifted) { ctx.lineWidth = 2; ctx.strokeStyle = colours[doing.kind]; ctx.stroke(); }
    if (doing.activity === "waiting" || doing.activity === "computing") ring(at, colours[doing.activity]);
    if (!lifted) label(String(i), at, data.robot, colours["robot-ink"]);
  }
}

/** Whether a robot carries object `k` above itself: their numbers would overlap. */
function overlaps(at, there, k) {
  return Math.hypot(at[0] - there[0], at[1] - there[1]) < Math.max(extent(data.robot), extent(data.things[k].shape)) * 0.9;
}

function ring(at, colour) {
  const [x, y] = px(at), r = extent(data.robot) * view.scale * 1.5 + 2;
  ctx.beginPath();
  ctx.arc(x, y, r, 0, 2 * Math.PI);
  ctx.lineWidth = 2.5;
  ctx.setLineDash([6, 4]);
  ctx.strokeStyle = colour;
  ctx.stroke();
  ctx.setLineDash([]);
}

function drawWaits(t) {
  for (let i = 0; i < data.robots.length; i++) {
    const doing = robotDoing(i, t);
    if (doing.activity !== "waiting" || !doing.wait) continue;
    const [what, id] = doing.wait;
    const from = px(robotAt(i, t)), to = px(what === "robot" ? robotAt(id, t) : objectAt(id, t));
    const far = Math.hypot(to[0] - from[0], to[1] - from[1]);
    if (far < 1) continue;
    const [ux, uy] = [(to[0] - from[0]) / far, (to[1] - from[1]) / far];
    const tip = [to[0] - ux * extent(data.robot) * view.scale, to[1] - uy * extent(data.robot) * view.scale];
    ctx.strokeStyle = ctx.fillStyle = colours.waiting;
    ctx.lineWidth = 2.5;
    ctx.beginPath();
    ctx.moveTo(from[0] + ux * extent(data.robot) * view.scale, from[1] + uy * extent(data.robot) * view.scale);
    ctx.lineTo(tip[0] - ux * 6, tip[1] - uy * 6);
    ctx.stroke();
    ctx.beginPath();
    polygon([tip, [tip[0] - ux * 10 - uy * 5, tip[1] - uy * 10 + ux * 5], [tip[0] - ux * 10 + uy * 5, tip[1] - uy * 10 - ux * 5]]);
    ctx.fill();
  }
}

function draw(t) {
  ctx.setTransform(view.ratio, 0, 0, view.ratio, 0, 0);
  ctx.fillStyle = colours.card;
  ctx.fillRect(0, 0, view.width, view.height);
  drawFloor();
  if ($("show-trails").checked) drawTrails(t);
  drawPlaces(t);
  const carried = carriedAt(t);
  if ($("show-grants").checked) drawGrants(t, carried);
  drawWalls(t);
  if ($("show-ways").checked) drawWays(t);
  drawObjects(t);
  drawRobots(t, carried);
  drawWaits(t);
}

// --- the timeline: a lane for each robot, marks for what happened --------------------------------------

const lanes = $("lanes"), THUMB = 2, MARKS = 12;

function drawLanes() {
  const width = $("timeline").clientWidth, n = data.robots.length;
  const lane = Math.max(1, Math.min(12, Math.floor(110 / n)));
  const gap = lane > 4 ? 2 : 0;
  const height = MARKS + n * (lane + gap) + 6;
  lanes.style.height = height + "px";
  lanes.width = Math.round(width * view.ratio);
  lanes.height = Math.round(height * view.ratio);
  const pen = lanes.getContext("2d");
  pen.setTransform(view.ratio, 0, 0, view.ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  const x = (t) => THUMB + (t / UNTIL) * (width - 2 * THUMB);
  data.robots.forEach((robot, i) => {
    const y = MARKS + i * (lane + gap);
    robot.doing.forEach(([from, [phase, activity]], k) => {
      const to = k + 1 < robot.doing.length ? robot.doing[k + 1][0] : UNTIL;
      pen.globalAlpha = phase === "idle" ? 0.25 : 1;
      pen.fillStyle = activity === "waiting" || activity === "computing" ? colours[activity] : colours[kindOf(phase)];
      const wide = Math.max(x(to) - x(from), 0.6);
      // Half as high where the robot stands: waiting is seen at a glance, also without colours.
      const low = activity === "waiting" || activity === "computing" ? 0.5 : 1;
      pen.fillRect(x(from), y + lane * (1 - low), wide, lane * low);
    });
  });
  pen.globalAlpha = 1;
  for (const event of data.events) {
    const colour = { completed: colours.transfer, failed: colours.failing, constraint: colours.selecting, violated: colours.failing }[event.event];
    if (!colour) continue;
    pen.fillStyle = colour;
    pen.fillRect(x(event.t) - 1, 2, 2, MARKS - 4);
  }
  pen.fillStyle = colours.failing;
  pen.globalAlpha = 0.35;
  for (const [from, to] of data.gaps) pen.fillRect(x(from), 0, Math.max(2, x(to) - x(from)), height);
  pen.globalAlpha = 1;
}

// --- the panels -----------------------------------------------------------------------------------

function element(name, text, attributes = {}) {
  const made = document.createElement(name);
  if (text !== undefined) made.textContent = text;
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
}

function setText(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

function rows(body, count, noun, columns) {
  return Array.from({ length: count }, (_, i) => {
    const row = element("tr");
    row.append(element("th", String(i), { scope: "row", "aria-label": `${noun} ${i}` }));
    const cells = Array.from({ length: columns }, () => row.appendChild(element("td")));
    body.append(row);
    return cells;
  });
}

const robotRows = rows($("robots"), data.robots.length, "robot", 3);
const robotDots = robotRows.map(([does]) => {
  const dot = element("span", "", { class: "dot" }), words = element("span");
  does.append(dot, words);
  return { dot, words };
});
const taskRows = rows($("tasks"), data.things.length, "task", 2);
const eventRows = data.events.map((event) => {
  const item = element("li"), button = element("button", undefined, { type: "button" });
  button.append(element("time", seconds(event.t) + " s"), element("span", sentence(event)));
  button.addEventListener("click", () => seek(event.t));
  item.append(button);
  $("events").append(item);
  return button;
});

let lastRow = -1;

function showEvents(t) {
  const current = last(data.events.length, (i) => data.events[i].t, t);
  if (current === lastRow) return;
  eventRows[lastRow]?.classList.remove("last");
  for (let i = Math.min(current, lastRow) + 1; i <= Math.max(current, lastRow); i++) eventRows[i].classList.toggle("past", i <= current);
  const row = eventRows[current];
  if (row) {
    row.classList.add("last");
    // Within the list only: the page itself must not jump.
    const list = $("events");
    list.scrollTop = row.offsetTop - list.clientHeight / 2;
  }
  lastRow = current;
  setText($("now"), current < 0 ? "" : `${seconds(data.events[current].t)} s: ${sentence(data.events[current])}`);
}

function showPanels(t) {
  const unmet = unmetAt(t);
  data.robots.forEach((_, i) => {
    const doing = robotDoing(i, t);
    robotDots[i].dot.style.background = colours[doing.kind];
    const what = doing.phase === "transfer" && doing.holding != null ? `carries ${doing.holding}` : PHASES[doing.phase];
    setText(robotDots[i].words, !hasRobot(i, t) ? "not there yet" : ACTIVITIES[doing.activity] ? `${what}, ${ACTIVITIES[doing.activity]}` : what);
    setText(robotRows[i][1], doing.task == null ? "–" : String(doing.task));
    setText(robotRows[i][2], waitsFor(doing));
  });
  const firsts = new Map();
  for (const [before, after] of unmet) firsts.set(after, [...(firsts.get(after) || []), before]);
  data.things.forEach((thing, i) => {
    const { status, robot } = taskDoing(i, t);
    const words = !isThere(i, t) ? "not there yet" : !goalAt(i, t) ? "no goal" : status === "done"
      ? (completedAt[i] > 0 ? `done at ${seconds(completedAt[i])} s` : "done")
      : `${STATUSES[status]}${robot == null ? "" : ` robot ${robot}`}`;
    setText(taskRows[i][0], words);
    const waits = status === "waiting" ? firsts.get(i) : undefined;
    setText(taskRows[i][1], waits ? waits.slice(0, 8).join(", ") + (waits.length > 8 ? ` and ${waits.length - 8} more` : "") : "");
  });
  showUnmet(unmet);
  showEvents(t);
}

let shownUnmet = "";

function showUnmet(unmet) {
  const key = JSON.stringify(unmet);
  if (key === shownUnmet) return;
  shownUnmet = key;
  setText($("unmet-count"), String(unmet.length));
  const most = 200;
  $("unmet").replaceChildren(...unmet.slice(0, most).map(([before, after, kinds]) => {
    const item = element("li", `${before} → ${after} `);
    item.append(element("small", kinds.join(", ")));
    return item;
  }));
  const more = unmet.length > most ? `and ${unmet.length - most} more. ` : "";
  setText($("unmet-note"), more + (unmet.length === 0 ? "None." : "1 → 2: task 1 has to be completed before 2 may be selected."));
}

// --- time -----------------------------------------------------------------------------------------

const state = { t: 0, playing: false, speed: 4, frame: 0, before: 0, panels: 0 };

function show(force) {
  draw(state.t);
  const now = performance.now();
  if (force || now - state.panels > 100) {
    state.panels = now;
    showPanels(state.t);
  }
  const text = seconds(state.t);
  $("clock").innerHTML = `${text} s <small>of ${seconds(UNTIL)} s</small>`;
  const scrub = $("scrub");
  scrub.value = String(state.t / 1e9);
  scrub.setAttribute("aria-valuetext", `${text} s of ${seconds(UNTIL)} s`);
}

function seek(t) {
  state.t = Math.min(Math.max(t, 0), UNTIL);
  show(true);
}

function tick(now) {
  if (!state.playing) return;
  // A frame may carry an earlier time than the click that began it.
  state.t = Math.min(state.t + Math.max(now - state.before, 0) * 1e6 * state.speed, UNTIL);
  state.before = now;
  if (state.t >= UNTIL) pause(); else state.frame = requestAnimationFrame(tick);
  show(!state.playing);
}

function play() {
  if (state.playing) return;
  if (state.t >= UNTIL) state.t = 0;
  state.playing = true;
  state.before = performance.now();
  state.frame = requestAnimationFrame(tick);
  $("now").setAttribute("aria-live", "off");
  playButton(icon("M4 2h3v12H4zM9 2h3v12H9z"), "Pause");
}

function pause() {
  state.playing = false;
  cancelAnimationFrame(state.frame);
  $("now").setAttribute("aria-live", "polite");
  playButton(icon("M4 2l10 6-10 6z"), "Play");
  show(true);
}

const icon = (path) => `<svg viewBox="0 0 16 16" width="16" height="16" aria-hidden="true"><path d="${path}" fill="currentColor"/></svg>`;

function playButton(sign, word) {
  $("play").innerHTML = sign;
  $("play").setAttribute("aria-label", word);
  $("play").title = `${word} (space)`;
}

function step(direction) {
  const times = data.events.map((event) => event.t);
  const next = direction > 0 ? times.find((t) => t > state.t + 1) : times.findLast((t) => t < state.t - 1);
  seek(next ?? (direction > 0 ? UNTIL : 0));
}

function setSpeed(speed) {
  state.speed = speed;
  $("speed").value = String(speed);
}

function zoom(factor, about) {
  const old = view.zoom;
  view.zoom = Math.min(Math.max(view.zoom * factor, 1), 40);
  if (about) view.centre = view.centre.map((c, k) => about[k] + (c - about[k]) * old / view.zoom);
  place();
  draw(state.t);
}

// --- hands ----------------------------------------------------------------------------------------

const KEYS = {
  " ": () => (state.playing ? pause() : play()),
  ArrowLeft: (event) => seek(state.t - (event.shiftKey ? 10e9 : 1e9)),
  ArrowRight: (event) => seek(state.t + (event.shiftKey ? 10e9 : 1e9)),
  Home: () => seek(0),
  End: () => seek(UNTIL),
  ",": () => step(-1),
  ".": () => step(1),
  "[": () => setSpeed(SPEEDS[Math.max(SPEEDS.indexOf(state.speed) - 1, 0)]),
  "]": () => setSpeed(SPEEDS[Math.min(SPEEDS.indexOf(state.speed) + 1, SPEEDS.length - 1)]),
  "+": () => zoom(1.5),
  "=": () => zoom(1.5),
  "-": () => zoom(1 / 1.5),
  "0": () => zoom(0),
};

function listen() {
  $("play").addEventListener("click", () => KEYS[" "]());
  $("before").addEventListener("click", () => step(-1));
  $("after").addEventListener("click", () => step(1));
  $("closer").addEventListener("click", () => zoom(1.5));
  $("wider").addEventListener("click", () => zoom(1 / 1.5));
  $("fit").addEventListener("click", () => zoom(0));
  $("scrub").addEventListener("input", (event) => seek(Number(event.target.value) * 1e9));
  $("speed").addEventListener("change", (event) => setSpeed(Number(event.target.value)));
  for (const id of ["show-grants", "show-trails", "show-ways"]) $(id).addEventListener("change", () => draw(state.t));
  document.addEventListener("keydown", (event) => {
    const target = event.target.tagName;
    if (event.ctrlKey || event.metaKey || event.altKey || target === "SELECT") return;
    // A button does its own thing on space, and so does a switch.
    const own = target === "BUTTON" || event.target.type === "checkbox";
    const act = event.key === " " && own ? null : KEYS[event.key];
    if (!act) return;
    event.preventDefault();
    act(event);
  });
  const world = (event) => {
    const box = canvas.getBoundingClientRect();
    return [(event.clientX - box.left - view.x) / view.scale, (view.y - (event.clientY - box.top)) / view.scale];
  };
  canvas.addEventListener("wheel", (event) => {
    // Plain wheels scroll the page; with ctrl, and so for a pinch, they zoom.
    if (!event.ctrlKey) return;
    event.preventDefault();
    zoom(Math.exp(-event.deltaY / 200), world(event));
  }, { passive: false });
  canvas.addEventListener("dblclick", (event) => zoom(2, world(event)));
  canvas.addEventListener("pointermove", (event) => {
    if (event.buttons !== 1 || view.zoom === 1) return;
    view.centre = [view.centre[0] - event.movementX / view.scale, view.centre[1] + event.movementY / view.scale];
    place();
    draw(state.t);
  });
  const again = () => { readColours(); layOut(); drawLanes(); show(true); };
  new ResizeObserver(again).observe($("stage"));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", again);
}

// --- set-up ---------------------------------------------------------------------------------------

function head() {
  const end = data.end;
  const count = (n, noun) => `${n} ${noun}${n === 1 ? "" : "s"}`;
  setText($("name"), data.name);
  const ending = end ? `${end.outcome} after ${seconds(UNTIL)} s` : `the first ${seconds(UNTIL)} s`;
  setText($("summary"), [count(data.things.length, "object"), count(data.robots.length, "robot"), data.method, ending].filter(Boolean).join(" · "));
  const warnings = [];
  if (!end) warnings.push(`The trace was cut short: it shows the run up to ${seconds(UNTIL)} s and does not tell how it ended.`);
  if (data.gaps.length) warnings.push(`The trace is incomplete: motion is missing ${data.gaps.map(([from, to]) => `from ${seconds(from)} to ${seconds(to)} s`).slice(0, 5).join(", ")}${data.gaps.length > 5 ? ", …" : ""}; bodies stand there where they were last seen.`);
  else if (end && !end.complete) warnings.push("The trace is incomplete: motion is missing.");
  if (end && end.outcome !== "solved") warnings.push(`The run ended ${end.outcome}${end.reason ? ": " + end.reason : "."}`);
  $("warning").hidden = warnings.length === 0;
  setText($("warning"), warnings.join(" "));
  setText($("made"), `Made by rearrange view ${data.version} from the trace of a run of ${data.name} (scenario ${data.hash}). Motion is shown exactly as recorded; what robots do and what is granted, as of the last state recorded. Whom a robot waits for is whom it names when its task fails, or else the first body in the way it takes later. Easy constraints (E1–E4) follow from where objects stand at the start, hard ones (H1, H2) appear when they came into force.`);
}

function legend() {
  const svg = (inside) => `<svg viewBox="0 0 18 18" aria-hidden="true">${inside}</svg>`;
  const box = (style) => svg(`<rect x="2" y="2" width="14" height="14" rx="2" style="${style}"/>`);
  const items = [
    ...Object.entries(KINDS).map(([kind, words]) => [box(`fill:var(--${kind})`), words]),
    [svg(`<circle cx="9" cy="9" r="7" style="fill:none;stroke:var(--waiting);stroke-width:2;stroke-dasharray:4 3"/>`), "waits"],
    [svg(`<circle cx="9" cy="9" r="7" style="fill:none;stroke:var(--computing);stroke-width:2;stroke-dasharray:4 3"/>`), "computes"],
    [box("fill:var(--object);stroke:var(--object-line);stroke-width:1.5"), "object"],
    [box("fill:var(--done);stroke:var(--done-line);stroke-width:1.5"), "object at its goal"],
    [box("fill:none;stroke:var(--goal);stroke-width:1.75;stroke-dasharray:4 3"), "goal"],
    [box("fill:none;stroke:var(--home);stroke-width:1.5;stroke-dasharray:2 2"), "home"],
    [box("fill:var(--transit);opacity:0.3"), "granted way"],
    [box("fill:var(--wall)"), "wall"],
  ];
  for (const [sign, words] of items) {
    const item = element("li");
    item.innerHTML = sign;
    item.append(words);
    $("legend").append(item);
  }
}

for (const speed of SPEEDS) $("speed").append(element("option", `${speed}×`, { value: String(speed) }));
$("before").innerHTML = icon("M3 3h2v10H3zM13 3v10L6 8z");
$("after").innerHTML = icon("M11 3h2v10h-2zM3 3l7 5-7 5z");
setSpeed(state.speed);
$("scrub").max = String(UNTIL / 1e9);
head();
legend();
readColours();
layOut();
drawLanes();
listen();
pause();
seek(data.at_s * 1e9);

window.replay = {
  play, pause,
  seek: (time_s) => seek(time_s * 1e9),
  time: () => state.t / 1e9,
  playing: () => state.playing,
  robots: () => data.robots.map((_, i) => ({ there: hasRobot(i, state.t), at: robotAt(i, state.t), ...robotDoing(i, state.t), grant: grantAt(i, state.t) })),
  objects: () => data.things.map((_, i) => ({ at: objectAt(i, state.t), ...taskDoing(i, state.t) })),
  unmet: () => unmetAt(state.t),
};
})();
