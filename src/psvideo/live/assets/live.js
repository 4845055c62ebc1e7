// The live page: it asks for the newest pictures, draws them, and asks again; what it has no time for it never gets.
import { parseBlock } from "./block.js";
import { openStage } from "./stage.js";
import { directionAt } from "./lights.js";
import { SAME } from "./matrix.js";

const at = (id) => document.getElementById(id);
const stage = openStage(at("picture"));
const held = {};
const light = { name: "Light", direction: directionAt(0.45, 0.5), colour: "#ffffff", intensity: 1, near: false, distance: 1 };
const SENTENCES = { preparing: "Getting ready", seeking: "Looking for the strobe", locked: "Locked", unsure: "Not sure of the strobe", lost: "Strobe lost", silent: "No frames come" };
let socket = null;
let seen = 0;
let drawn = 0;
let chosen = "";

// Software that draws needs time for every pixel, and takes it from the frames. Where drawing takes longer than
// MOST_DRAW_MS, a share of the pixels a side is drawn and the browser stretches them: a picture that comes late shows less.
const MOST_DRAW_MS = 8;
const DRAWN_SHARES = [1, 0.8, 0.6];
const JUDGED_BY = 5; // drawings until their median is judged
const UNTIMED = 7; // drawings that follow where the share stays: to wait for the renderer takes time, too
const pace = { share: DRAWN_SHARES[0], took: [], passed: 0 };

function shareAfter(share, took) {
  if (took.length < JUDGED_BY) return share;
  const median = [...took].sort((one, other) => one - other)[took.length >> 1];
  const at = DRAWN_SHARES.indexOf(share);
  if (median > MOST_DRAW_MS) return DRAWN_SHARES[Math.min(at + 1, DRAWN_SHARES.length - 1)];
  const larger = DRAWN_SHARES[Math.max(at - 1, 0)];
  return median * (larger / share) ** 2 < MOST_DRAW_MS / 2 ? larger : share;
}

// Draw, and see now and then how long it takes until the renderer has done all that it was given.
function drawTimed() {
  pace.passed += 1;
  if (pace.took.length === 0 && pace.passed <= UNTIMED) {
    drawPanes();
    return;
  }
  const began = performance.now();
  drawPanes();
  stage.finish();
  pace.took.push(performance.now() - began);
  if (pace.took.length < JUDGED_BY) return;
  const share = shareAfter(pace.share, pace.took);
  Object.assign(pace, { share, took: [], passed: share === pace.share ? 0 : UNTIMED });
}

function look(kind, main, exposure) {
  return { kind, main, blocks: held, from: "live", sequence: { y: "up", kind }, exposure, toCamera: SAME, origin: [0, 0, 0],
    aspect: held[main].height / held[main].width, range: [0, 1], place: { id: null, kind: 0, middle: [0, 0, 0], scale: 1 },
    lights: [light], specular: 0, exponent: 1, around: null, window: { x: 0, y: 0, width: 1, height: 1 },
    markInvalid: false, quick: false, sharp: false, channels: 0 };
}

// The panes that there are pictures for, the first the largest.
function paneLooks() {
  const panes = [];
  if (held.normals && held.albedo) panes.push(["relit: the light follows the pointer", look("relit", "normals", held.albedo.facts.exposure)]);
  if (held.normals) panes.push(["normals", look("normals", "normals", 1)]);
  if (held.plate) panes.push([`plate: ${held.plate.facts.light}`, look("light", "plate", held.plate.facts.exposure)]);
  if (held.frame) panes.push(["frame", look("light", "frame", held.frame.facts.exposure)]);
  return panes;
}

function drawPanes() {
  const box = at("viewer").getBoundingClientRect();
  const scale = Math.min(window.devicePixelRatio || 1, 2) * pace.share;
  stage.resize(Math.round(box.width * scale), Math.round(box.height * scale));
  stage.clear();
  const panes = paneLooks();
  const below = panes.length > 1 ? Math.round(stage.canvas.height * 0.3) : 0;
  const labels = [];
  panes.forEach(([name, one], place) => {
    const cell = place === 0 ? { x: 0, y: 0, width: stage.canvas.width, height: stage.canvas.height - below }
      : { x: Math.round((place - 1) * stage.canvas.width / (panes.length - 1)), y: stage.canvas.height - below,
        width: Math.floor(stage.canvas.width / (panes.length - 1)) - 2, height: below - 2 };
    const width = Math.min(cell.width, Math.round(cell.height / one.aspect));
    const rect = { x: cell.x + Math.round((cell.width - width) / 2), y: cell.y + Math.round((cell.height - width * one.aspect) / 2),
      width, height: Math.round(width * one.aspect) };
    stage.draw(one, rect, cell);
    labels.push(labelled(name, (cell.x + 8) / scale, (cell.y + 8) / scale));
    if (one.main === "frame") labels.push(...bands(rect, scale));
  });
  putMarks(labels);
}

function labelled(text, left, top) {
  return { kind: "span", text, name: "", style: `left: ${left}px; top: ${top}px` };
}

// Show exactly these marks; unchanged ones stay, because browsers lay out and repaint what is replaced.
function putMarks(marks) {
  const box = at("labels");
  while (box.children.length > marks.length) box.lastChild.remove();
  marks.forEach((mark, place) => {
    const key = JSON.stringify(mark);
    let node = box.children[place];
    if (node && node.dataset.key === key) return;
    if (!node || node.localName !== mark.kind) {
      const made = document.createElement(mark.kind);
      if (node) node.replaceWith(made);
      else box.append(made);
      node = made;
    }
    node.dataset.key = key;
    node.className = mark.name;
    node.style.cssText = mark.style;
    if (node.textContent !== mark.text) node.textContent = mark.text;
  });
}

const BELOW_NAME = 32; // the pane's own name stands above

// Which rows of the frame which light reached, beside the frame; the dark row is where none did.
function bands(rect, scale) {
  const { rows, height } = held.frame.facts;
  return rows.flatMap(([first, last, name]) => {
    const left = (rect.x + rect.width) / scale - 6;
    const top = (rect.y + first / height * rect.height) / scale;
    const tall = (last - first) / height * rect.height / scale;
    const mark = { kind: "i", text: "", name: name ? "" : "dark", style: `left: ${left}px; top: ${top}px; height: ${tall}px` };
    const middle = (rect.y + (first + last) / 2 / height * rect.height) / scale - 10;
    return [mark, labelled(name || "dark row", rect.x / scale + 4, Math.max(middle, rect.y / scale + BELOW_NAME))];
  });
}

const known = {};

// Whether what is told under a name differs from what was told before.
function isNew(name, told) {
  const text = JSON.stringify(told);
  const changed = known[name] !== text;
  known[name] = text;
  return changed;
}

function write(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

function showStatus(told) {
  at("state").dataset.state = told.state;
  at("alarm").hidden = !told.alarm;
  write(at("alarm"), told.alarm || "");
  write(at("state-words"), told.compiling || (told.state === "locked" ? told.verdict || "Locked" : SENTENCES[told.state]));
  write(at("facts"), told.line === told.compiling ? "" : told.line);
  if (isNew("lines", told.lines)) at("lines").replaceChildren(...told.lines.map(({ subject, grade, sentence }) => {
    const line = document.createElement("li");
    const word = document.createElement("b");
    line.className = grade;
    word.textContent = subject;
    line.append(word, sentence);
    return line;
  }));
  if (isNew("histograms", [told.histograms, told.powers])) showHistograms(told.histograms, told.powers || {});
  if (isNew("ball", told.ball || [])) showWords(at("ball-words"), told.ball || []);
  if (isNew("notes", told.notes || [])) showWords(at("notes"), told.notes || []);
  const names = told.lights.join();
  if (names !== at("plate").dataset.names) {
    at("plate").dataset.names = names;
    at("plate").replaceChildren(...told.lights.map((name) => new Option(name)));
  }
}

function showWords(list, words) {
  list.hidden = words.length === 0;
  list.replaceChildren(...words.map((sentence) => {
    const line = document.createElement("li");
    line.textContent = sentence;
    return line;
  }));
}

function showHistograms(histograms, powers) {
  const box = at("histograms");
  const names = Object.keys(histograms);
  if (box.children.length !== names.length) {
    box.replaceChildren(...names.map((name) => {
      const figure = document.createElement("figure");
      const caption = document.createElement("figcaption");
      figure.append(document.createElement("canvas"), caption);
      return figure;
    }));
  }
  names.forEach((name, place) => {
    drawHistogram(box.children[place].firstChild, histograms[name]);
    write(box.children[place].lastChild, powers[name] ? `${name}: ${powers[name]}` : name);
  });
}

function drawHistogram(canvas, counts) {
  canvas.width = 4 * counts.length;
  canvas.height = 62;
  const pen = canvas.getContext("2d");
  const most = Math.log1p(Math.max(...counts.slice(1), 1));
  counts.forEach((count, bin) => {
    const tall = Math.round(58 * Math.min(Math.log1p(count) / most, 1));
    pen.fillStyle = bin === counts.length - 1 ? "#ff7a66" : "#cfcfcf";
    pen.fillRect(4 * bin, 62 - tall, 3, tall);
  });
}

function askNext() {
  if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify({ seen, plate: chosen }));
}

// One answer is a status, as text, and then the pictures that are newer than those seen, each a block of bytes.
function connect() {
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  socket = new WebSocket(`${scheme}://${location.host}/newest${location.search}`);
  socket.binaryType = "arraybuffer";
  let pictures = 0;
  socket.onopen = () => { seen = 0; askNext(); };
  socket.onclose = () => {
    at("state").dataset.state = "away";
    at("alarm").hidden = true;
    write(at("facts"), "");
    at("state-words").textContent = "No connection to psvideo live";
    setTimeout(connect, 1000);
  };
  socket.onmessage = ({ data }) => {
    if (typeof data === "string") {
      const told = JSON.parse(data);
      pictures = told.pictures;
      seen = told.number;
      showStatus(told);
    } else {
      const block = parseBlock(data);
      held[block.facts.id] = block;
      pictures -= 1;
    }
    if (pictures > 0) return;
    requestAnimationFrame(() => {
      drawTimed();
      drawn += 1;
      document.body.dataset.drawn = String(drawn);
      if (held.frame) document.dispatchEvent(new CustomEvent("drawn", { detail: held.frame.facts }));
      askNext();
    });
  };
}

at("ball").onclick = () => { if (socket && socket.readyState === WebSocket.OPEN) socket.send("ball"); };
at("plate").onchange = () => { chosen = at("plate").value; };
at("viewer").onpointermove = (moved) => {
  const box = at("viewer").getBoundingClientRect();
  light.direction = directionAt(2 * (moved.clientX - box.left) / box.width - 1, 1 - 2 * (moved.clientY - box.top) / box.height);
};
globalThis.psvideoLive = { held, shareAfter, relit: () => stage.relitValues(look("relit", "normals", 1)) };
if (stage) connect();
else at("state-words").textContent = "This browser has no WebGL 2, which the live view needs.";
