"use strict";
// Plays recorded sessions: skeletons on a ground that turns, a timeline to scrub, and why each moment came out as it did. Texts of a
// session are set as text, never as markup. `data` is what contextdb.report.session_data makes.
const COLOURS = ["#4a86d8", "#e08214", "#2f9e62", "#a05fc7", "#c9a227", "#3aa6b9", "#c7527a", "#7a8b3a", "#8d6e63", "#6b7fd7"];
const STRIPS = [
  ["cost", "cost", ""], ["skate", "skate", "cm/s", 1], ["accel", "acceleration", "m/s²", 1], ["error", "off the path", "m", 0.01], ["valid", "rows valid", ""],
];
const data = JSON.parse(document.getElementById("session").textContent);
const $ = (id) => document.getElementById(id);
const reduced = matchMedia("(prefers-reduced-motion: reduce)").matches;

function element(name, text, className) {
  const made = document.createElement(name);
  if (text !== undefined) made.textContent = text;
  if (className) made.className = className;
  return made;
}

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
const colourOf = (index) => (index < 0 ? colour("line") : COLOURS[index % COLOURS.length]);
const number = (value, digits = 3) => (value === null || Number.isNaN(value) ? "–" : Number(value.toPrecision(digits)).toLocaleString("en"));

// ---- reading what is packed

async function inflated(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Response(stream).arrayBuffer();
}

const KINDS = { i1: Int8Array, u1: Uint8Array, i2: Int16Array, i4: Int32Array, f4: Float32Array };

async function unpacked(column) {
  const values = new KINDS[column.type](await inflated(column.data));
  const width = column.delta || 0; // each value but those of the first row is kept as what it differs from the row before
  for (let i = width; width && i < values.length; i++) values[i] += values[i - width];
  return values;
}

async function sessionOf(raw) {
  const session = { ...raw, columns: {} };
  for (const [name, column] of Object.entries(raw.columns)) session.columns[name] = await unpacked(column);
  session.jumps = [];
  const flags = session.columns.flags;
  for (let i = 0; i < session.n; i++) if (flags[i] & 2) session.jumps.push(i);
  session.byFrame = new Map(raw.moments.map((moment) => [moment.i, moment]));
  for (const moment of raw.moments) {
    moment.seen = await Promise.all(moment.ghosts.map(unpacked));
    moment.bars = moment.landscape ? await unpacked(moment.landscape.bars) : null;
  }
  return session;
}

// ---- what is shown

const view = { at: 0, plays: false, rate: 1, yaw: 0.7, pitch: 0.35, distance: 3.4, span: 0, ghosts: true, measure: "skate" };
let sessions = [];
let lanes = [];

const timeOf = (session, i) => i / session.rate;
const frameOf = (session, time) => Math.max(0, Math.min(session.n - 1, Math.round(time * session.rate)));
const lastS = () => Math.max(...sessions.map((s) => timeOf(s, s.n - 1)));

function momentOf(session, frame) {
  let found = null;
  for (const moment of session.moments) {
    if (moment.i > frame) break;
    found = moment;
  }
  return found;
}

// ---- the stage: bones over a ground

function fitted(canvas) {
  const scale = devicePixelRatio || 1;
  const box = canvas.getBoundingClientRect();
  const [width, height] = [Math.max(1, Math.round(box.width * scale)), Math.max(1, Math.round(box.height * scale))];
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  const pen = canvas.getContext("2d");
  pen.setTransform(scale, 0, 0, scale, 0, 0);
  pen.clearRect(0, 0, box.width, box.height);
  return [pen, box.width, box.height];
}

function camera(width, height, target) {
  const [sy, cy, sp, cp] = [Math.sin(view.yaw), Math.cos(view.yaw), Math.sin(view.pitch), Math.cos(view.pitch)];
  const focus = Math.min(width, height * 1.4) * 0.95;
  return (x, y, z) => {
    const [dx, dy, dz] = [x - target[0], y - target[1], z - target[2]];
    const side = cy * dx - sy * dz;
    const back = sy * dx + cy * dz;
    const up = cp * dy - sp * back;
    const depth = view.distance - (sp * dy + cp * back);
    return depth < 0.1 ? null : [width / 2 + (focus * side) / depth, height / 2 - (focus * up) / depth];
  };
}

function line(pen, look, points, style, width, dashes) {
  pen.strokeStyle = style;
  pen.lineWidth = width;
  pen.setLineDash(dashes || []);
  pen.beginPath();
  let isDown = false;
  for (const point of points) {
    const seen = look(...point);
    if (seen && isDown) pen.lineTo(...seen);
    else if (seen) pen.moveTo(...seen);
    isDown = Boolean(seen);
  }
  pen.stroke();
  pen.setLineDash([]);
}

function ground(pen, look, target) {
  const [cx, cz, reach] = [Math.round(target[0]), Math.round(target[2]), 6];
  for (let i = -reach; i <= reach; i++) {
    line(pen, look, [[cx + i, 0, cz - reach], [cx + i, 0, cz + reach]], colour("line"), 1);
    line(pen, look, [[cx - reach, 0, cz + i], [cx + reach, 0, cz + i]], colour("line"), 1);
  }
}

function rootOf(session, frame) {
  const root = session.columns.root;
  return [root[3 * frame] / 1000, root[3 * frame + 1] / 1000, root[3 * frame + 2] / 10000];
}

function jointsOf(session, values, at, root) {
  const joints = [];
  for (let j = 0; j < session.parents.length; j++) {
    const k = (at * session.parents.length + j) * 3;
    joints.push([root[0] + values[k] / 1000, values[k + 1] / 1000, root[1] + values[k + 2] / 1000]);
  }
  return joints;
}

function bones(pen, look, session, joints, style, width) {
  session.parents.forEach((parent, j) => {
    if (parent < 0) return;
    const side = session.sides[j];
    line(pen, look, [joints[parent], joints[j]], style || (side ? colour(side) : colour("text")), width);
  });
}

function feet(pen, look, session, joints, frame) {
  session.feet.forEach((joint, k) => {
    const seen = look(...joints[joint]);
    if (!seen || !((session.columns.contacts[frame] >> k) & 1)) return;
    pen.fillStyle = colour("good");
    pen.beginPath();
    pen.arc(seen[0], seen[1], 5, 0, 2 * Math.PI);
    pen.fill();
  });
}

function track(values, from, to) {
  const points = [];
  for (let i = from; i <= to; i++) points.push([values[3 * i] / 1000, 0, values[3 * i + 1] / 1000]);
  return points;
}

function drawStage(lane) {
  const { session, canvas } = lane;
  const frame = frameOf(session, view.at);
  const [pen, width, height] = fitted(canvas);
  const root = rootOf(session, frame);
  const target = [root[0], 0.85, root[1]];
  const look = camera(width, height, target);
  ground(pen, look, target);
  const reach = Math.round(2 * session.rate);
  const [from, to] = [Math.max(0, frame - reach), Math.min(session.n - 1, frame + reach)];
  if (session.columns.body) line(pen, look, track(session.columns.body, from, to), colour("wanted"), 2, [6, 4]);
  line(pen, look, track(session.columns.root, from, to), colour("accent"), 2);
  const moment = momentOf(session, frame);
  const shown = view.ghosts && moment ? moment.ghosts.filter((ghost) => frame - moment.i < ghost.frames) : [];
  for (const ghost of shown) {
    const joints = jointsOf(session, moment.seen[moment.ghosts.indexOf(ghost)], frame - moment.i, root);
    bones(pen, look, session, joints, ghost.plays_on ? colour("wanted") : colour("muted"), 1.5);
  }
  const joints = jointsOf(session, session.columns.positions, frame, root);
  bones(pen, look, session, joints, "", 3);
  feet(pen, look, session, joints, frame);
  const playing = session.columns.asset[frame];
  const says = playing < 0 ? "nothing plays" : `${session.assets[playing]} at ${(session.columns.at[frame] / 1000).toFixed(2)} s`;
  const also = shown.map((ghost) => (ghost.plays_on ? `${ghost.asset}, had it played on` : ghost.asset));
  lane.says.textContent = says + (also.length ? `; pale: ${also.join(", ")}` : "");
}

// ---- the timeline

const BAND = 22;
const NAMES = 28; // two lines below the band, for names that are wider than their stretch of it
const STRIP = 30;

function range() {
  const last = lastS();
  if (!view.span || view.span >= last) return [0, Math.max(last, 1e-3)];
  const from = Math.max(0, Math.min(last - view.span, view.at - view.span / 2));
  return [from, from + view.span];
}

const stripsOf = (session) => STRIPS.filter(([name]) => session.columns[name]);

function drawTimeline(lane) {
  const { session, timeline } = lane;
  const [pen, width] = fitted(timeline);
  const [from, to] = range();
  const x = (time) => ((time - from) / (to - from)) * width;
  const [first, last] = [frameOf(session, from), frameOf(session, to)];
  pen.font = "12px system-ui, sans-serif";
  band(pen, session, x, first, last, width);
  stripsOf(session).forEach((one, k) => strip(pen, session, one, x, first, last, BAND + NAMES + 14 + k * STRIP, width));
  pen.fillStyle = colour("text");
  pen.fillRect(x(view.at) - 1, 0, 2, timeline.getBoundingClientRect().height);
}

function band(pen, session, x, first, last, width) {
  const { asset, flags } = session.columns;
  const full = [0, 0]; // how far each line of names is full
  for (let i = first; i <= last; ) {
    let end = i + 1;
    while (end <= last && asset[end] === asset[i] && !(flags[end] & 2)) end++;
    const [left, right] = [x(timeOf(session, i)), x(timeOf(session, end))];
    pen.fillStyle = colourOf(asset[i]);
    pen.fillRect(left, 0, Math.max(1, right - left - 1), BAND);
    if (asset[i] >= 0) {
      const name = session.assets[asset[i]];
      const wide = pen.measureText(name).width;
      const at = Math.max(0, Math.min(left, width - wide));
      if (wide + 8 <= right - Math.max(0, left)) {
        pen.fillStyle = "#fff";
        pen.fillText(name, Math.max(0, left) + 4, 15);
      } else {
        const n = full.findIndex((end) => at >= end);
        pen.fillStyle = colour("text");
        if (n >= 0) pen.fillText(name, at, BAND + 20 + 13 * n);
        if (n >= 0) full[n] = at + wide + 10;
      }
    }
    i = end;
  }
  for (const i of session.jumps) {
    if (i < first || i > last) continue;
    const isForced = flags[i] & 4;
    const left = x(timeOf(session, i));
    pen.fillStyle = isForced ? colour("bad") : colour("text");
    pen.beginPath();
    pen.moveTo(left, BAND + 1);
    pen.lineTo(left - 4, BAND + 9);
    pen.lineTo(left + 4, BAND + 9);
    pen.fill();
  }
}

function strip(pen, session, [name, label, unit, least = 0], x, first, last, top, width) { // what is below `least` is not drawn large
  const values = session.columns[name];
  let most = least;
  for (let i = first; i <= last; i++) if (values[i] > most) most = values[i];
  pen.strokeStyle = colour("line");
  pen.lineWidth = 1;
  pen.strokeRect(0.5, top + 0.5, width - 1, STRIP - 4);
  pen.fillStyle = view.measure === name ? colour("accent") : colour("bar");
  for (let px = 0, i = first; px < width && i <= last; px++) { // the peak below each pixel
    let peak = -Infinity;
    for (; i <= last && x(timeOf(session, i)) < px + 1; i++) if (values[i] > peak) peak = values[i];
    if (peak > 0 && most > 0) {
      const tall = (peak / most) * (STRIP - 6);
      pen.fillRect(px, top + STRIP - 4 - tall, Math.max(1, x(timeOf(session, first + 1)) - x(timeOf(session, first))), tall);
    }
  }
  const text = `${label} ${number(values[frameOf(session, view.at)])} of ${number(most)} ${unit}`;
  pen.fillStyle = colour("back");
  pen.globalAlpha = 0.75;
  pen.fillRect(2, top + 2, pen.measureText(text).width + 6, 15);
  pen.globalAlpha = 1;
  pen.fillStyle = colour("text");
  pen.fillText(text, 5, top + 14);
}

// ---- why

function drawMoment(lane) {
  const frame = frameOf(lane.session, view.at);
  const moment = momentOf(lane.session, frame);
  if (lane.moment === moment && lane.isWritten) return;
  Object.assign(lane, { moment, isWritten: true });
  const box = lane.why;
  box.replaceChildren();
  if (!moment) return void box.append(element("p", "No search yet.", "muted"));
  const at = element("a", `${timeOf(lane.session, moment.i).toFixed(2)} s`);
  at.href = `#t=${timeOf(lane.session, moment.i).toFixed(2)}`;
  const title = element("p", undefined, moment.forced ? "why forced" : "why");
  title.append(at, element("span", ` ${moment.why}`));
  box.append(title);
  if (moment.status.length) box.append(element("p", moment.status.map(([name, value]) => `${name} ${value}`).join(" · "), "muted"));
  if (moment.context.length) box.append(element("p", moment.context.map(([name, value]) => `${name} = ${value}`).join(", "), "muted"));
  if (moment.candidates.length) box.append(candidates(lane.session, moment));
  if (moment.bars) box.append(...landscape(lane, moment));
}

function candidates(session, moment) {
  const holder = element("div", undefined, "scroll");
  holder.tabIndex = 0;
  const table = element("table");
  const head = table.createTHead().insertRow();
  for (const text of ["candidate", "at s", "cost", "made of", "left out"]) head.append(element("th", text, /^(at s|cost)$/.test(text) ? "n" : ""));
  const most = Math.max(...moment.candidates.map((c) => c.cost), 1e-9);
  const body = table.createTBody();
  for (const each of moment.candidates) {
    const row = body.insertRow();
    if (each.chosen) row.className = "chosen";
    row.append(element("td", session.assets[each.asset] + (each.mirrored ? " mirrored" : "") + (each.chosen ? " (chosen)" : "")));
    row.append(element("td", each.at.toFixed(2), "n"), element("td", number(each.cost), "n"));
    const parts = element("td", undefined, "parts");
    const said = each.parts.map((value, k) => `${moment.channels[k]} ${number(value)}`).join(", ");
    parts.title = said;
    parts.setAttribute("aria-label", said);
    each.parts.forEach((value, k) => {
      const bar = element("i");
      bar.style.width = `${Math.max(0, (100 * value) / most).toFixed(2)}%`;
      bar.style.background = COLOURS[k % COLOURS.length];
      parts.append(bar);
    });
    row.append(parts, element("td", each.left_out));
  }
  holder.append(table);
  const both = element("div");
  both.append(legend(moment.channels), holder);
  return both;
}

function legend(names) {
  const list = element("ul", undefined, "legend");
  names.forEach((name, k) => {
    const item = element("li", name);
    const mark = element("i");
    mark.style.background = COLOURS[k % COLOURS.length];
    item.prepend(mark);
    list.append(item);
  });
  return list;
}

function landscape(lane, moment) {
  const { assets, best, reasons, bins } = moment.landscape;
  const shown = assets.map((asset, k) => k).filter((k) => lane.session.assets[assets[k]].toLowerCase().includes(lane.filter.toLowerCase()));
  if (lane.order === "name") shown.sort((a, b) => lane.session.assets[assets[a]].localeCompare(lane.session.assets[assets[b]]));
  const table = element("table", undefined, "land");
  const head = table.createTHead().insertRow();
  for (const text of ["asset", "best cost", "its frames, from first to last: tall is good, grey may not play", "left out"]) head.append(element("th", text, text === "best cost" ? "n" : ""));
  const body = table.createTBody();
  for (const k of shown) {
    const row = body.insertRow();
    row.append(element("td", lane.session.assets[assets[k]]), element("td", best[k] === null ? "–" : number(best[k]), "n"));
    const cell = row.insertCell();
    const canvas = element("canvas", undefined, "bars");
    canvas.setAttribute("aria-hidden", "true");
    cell.append(canvas);
    row.append(element("td", reasons[k]));
    requestAnimationFrame(() => bars(canvas, moment.bars, k * bins, bins));
  }
  const holder = element("div", undefined, "scroll");
  holder.tabIndex = 0;
  holder.append(table);
  return [tools(lane), holder];
}

function tools(lane) {
  const box = element("p", undefined, "tools");
  const filter = Object.assign(element("input"), { type: "search", value: lane.filter, placeholder: "filter assets" });
  filter.setAttribute("aria-label", "filter assets");
  filter.addEventListener("input", () => {
    Object.assign(lane, { filter: filter.value, isWritten: false });
    draw();
    lane.why.querySelector("input").focus();
  });
  const order = element("select");
  order.setAttribute("aria-label", "order of the assets");
  for (const name of ["best", "name"]) order.append(Object.assign(element("option", `by ${name}`), { value: name, selected: lane.order === name }));
  order.addEventListener("change", () => {
    Object.assign(lane, { order: order.value, isWritten: false });
    draw();
  });
  box.append(filter, order);
  return box;
}

function bars(canvas, values, from, count) { // 0: no frame; 1 to 127: may not play; 128 to 255: may, the more the better
  const [pen, width, height] = fitted(canvas);
  const step = width / count;
  for (let i = 0; i < count; i++) {
    const value = values[from + i];
    if (!value) continue;
    const share = (value % 128) / 127;
    pen.fillStyle = value < 128 ? colour("line") : share > 0.8 ? colour("good") : colour("bar");
    const tall = Math.max(1, share * height);
    pen.fillRect(i * step, height - tall, Math.max(1, step - 0.5), tall);
  }
}

// ---- moving through time

function draw() {
  for (const lane of lanes) {
    drawStage(lane);
    drawTimeline(lane);
    drawMoment(lane);
  }
  $("clock").textContent = `${view.at.toFixed(2)} s of ${lastS().toFixed(2)} s`;
  $("time").value = String(view.at);
  $("time").setAttribute("aria-valuetext", `${view.at.toFixed(2)} seconds, ${lanes.map((lane) => lane.says.textContent).join("; ")}`);
  $("link").href = `#t=${view.at.toFixed(2)}`;
}

function go(time) {
  view.at = Math.max(0, Math.min(lastS(), time));
  draw();
}

function play(plays) {
  view.plays = plays;
  $("play").textContent = plays ? "Pause" : "Play";
  if (!plays) return;
  if (view.at >= lastS() - 1e-6) view.at = 0;
  let before = performance.now();
  const tick = (now) => {
    if (!view.plays) return;
    const next = view.at + ((now - before) / 1000) * view.rate;
    before = now;
    go(next);
    if (next >= lastS()) play(false);
    else requestAnimationFrame(tick);
  };
  requestAnimationFrame(tick);
}

function toJump(step) {
  const times = [...new Set(sessions.flatMap((s) => s.jumps.map((i) => timeOf(s, i))))].sort((a, b) => a - b);
  const found = step > 0 ? times.find((time) => time > view.at + 1e-6) : times.findLast((time) => time < view.at - 1e-6);
  if (found !== undefined) go(found);
}

function toPeak() { // the next local peak of the chosen measure above nine tenths of what it ever is
  const values = sessions[0].columns[view.measure];
  if (!values) return;
  const sorted = Array.from(values).filter((v) => v > 0).sort((a, b) => a - b);
  const bar = sorted[Math.floor(sorted.length * 0.95)] || 0;
  const isPeak = (i) => values[i] >= bar && values[i] > 0 && values[i] >= (values[i - 1] || 0) && values[i] >= (values[i + 1] || 0);
  const n = values.length;
  const here = frameOf(sessions[0], view.at);
  for (let step = 1; step <= n; step++) if (isPeak((here + step) % n)) return go(timeOf(sessions[0], (here + step) % n));
}

function fromAddress() {
  const found = /^#t=(\d+(?:\.\d+)?)$/.exec(location.hash);
  if (found) go(Number(found[1]));
}

const KEYS = {
  " ": () => play(!view.plays), ArrowLeft: (e) => go(view.at - (e.shiftKey ? 1 : 1 / sessions[0].rate)),
  ArrowRight: (e) => go(view.at + (e.shiftKey ? 1 : 1 / sessions[0].rate)), "[": () => toJump(-1), "]": () => toJump(1), n: toPeak,
  "+": () => zoom(0.8), "-": () => zoom(1.25), Home: () => go(0), End: () => go(lastS()),
};

function zoom(share) {
  view.distance = Math.max(1, Math.min(30, view.distance * share));
  draw();
}

function onKey(event) {
  const inField = /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName);
  if (inField || event.ctrlKey || event.metaKey || event.altKey || (event.key === " " && /^(BUTTON|A)$/.test(event.target.tagName))) return;
  const does = KEYS[event.key];
  if (!does) return;
  event.preventDefault();
  does(event);
}

function drags(canvas, onMove) {
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    onMove(event, true);
  });
  canvas.addEventListener("pointermove", (event) => canvas.hasPointerCapture(event.pointerId) && onMove(event, false));
}

function laneOf(session, number) {
  const lane = { session, moment: null, isWritten: false, filter: "", order: "best" };
  for (const [key, id] of Object.entries({ canvas: "stage", timeline: "timeline", says: "says", why: "why" })) lane[key] = $(`${id}${number}`);
  lane.timeline.style.height = `${BAND + NAMES + 16 + stripsOf(session).length * STRIP}px`;
  drags(lane.canvas, (event, isFirst) => {
    if (isFirst) return;
    view.yaw -= event.movementX * 0.01;
    view.pitch = Math.max(-0.1, Math.min(1.5, view.pitch + event.movementY * 0.01));
    draw();
  });
  lane.canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(event.deltaY > 0 ? 1.1 : 0.9);
  }, { passive: false });
  drags(lane.timeline, (event) => {
    const box = lane.timeline.getBoundingClientRect();
    const [from, to] = range();
    play(false);
    go(from + ((event.clientX - box.left) / box.width) * (to - from));
  });
  return lane;
}

async function start() {
  sessions = await Promise.all(data.sessions.map(sessionOf));
  $("player").hidden = false;
  lanes = sessions.map(laneOf);
  Object.assign($("time"), { max: String(lastS()), step: String(1 / sessions[0].rate) });
  $("time").addEventListener("input", () => {
    play(false);
    go(Number($("time").value));
  });
  $("play").addEventListener("click", () => play(!view.plays));
  $("back").addEventListener("click", () => toJump(-1));
  $("on").addEventListener("click", () => toJump(1));
  $("peak").addEventListener("click", toPeak);
  $("rate").addEventListener("change", () => (view.rate = Number($("rate").value)));
  $("span").addEventListener("change", () => {
    view.span = Number($("span").value);
    draw();
  });
  $("ghosts").addEventListener("change", () => {
    view.ghosts = $("ghosts").checked;
    draw();
  });
  const measures = STRIPS.filter(([name]) => sessions[0].columns[name]);
  if (!measures.some(([name]) => name === view.measure)) view.measure = measures.length ? measures[0][0] : "";
  for (const [name, label] of measures) $("measure").append(Object.assign(element("option", label), { value: name, selected: name === view.measure }));
  $("measure").addEventListener("change", () => {
    view.measure = $("measure").value;
    draw();
  });
  addEventListener("keydown", onKey);
  addEventListener("hashchange", fromAddress);
  addEventListener("resize", draw);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  go(Math.max(0, data.first_s - 1));
  fromAddress();
  if (!location.hash && !reduced && data.plays) play(true);
  document.documentElement.dataset.ready = "yes";
}

start().catch((error) => {
  $("trouble").hidden = false;
  $("trouble").textContent = `The moving part of this page did not start in this browser: ${error.message}`;
});
