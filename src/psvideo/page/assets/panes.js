// The panes over the canvas: what each shows, its caption, its legend, and the handles of the lights.
import { colourAt, paletteOf } from "./palettes.js";
import { isRelit, numberFor, resultOf, sequenceOf, sparedShare, windowOf } from "./looks.js";

const COUNTS = { one: 1, two: 2, four: 4, wipe: 2 };
const HANDLE_REACH = 0.46;

export function paneCount(layout) {
  return COUNTS[layout];
}

export function buildPanes(app) {
  const { layout, contents } = app.state;
  app.viewer.dataset.layout = layout;
  app.paneElements = contents.slice(0, paneCount(layout)).map((content, place) => pane(app, content, place));
  document.getElementById("panes").replaceChildren(...app.paneElements);
  document.getElementById("wipe").hidden = layout !== "wipe";
}

function pane(app, content, place) {
  const element = document.createElement("div");
  element.className = "pane";
  element.dataset.place = place;
  element.dataset.content = content;
  const head = document.createElement("div");
  head.className = "head";
  const mark = document.createElement("span");
  mark.className = "letter";
  mark.textContent = "ABCD"[place];
  const choice = document.createElement("select");
  choice.setAttribute("aria-label", `What picture ${"ABCD"[place]} shows`);
  choice.append(...options(app, content));
  choice.addEventListener("change", () => app.showIn(place, choice.value));
  const caption = document.createElement("span");
  caption.className = "caption";
  head.append(mark, choice, caption);
  const message = document.createElement("p");
  message.className = "message";
  message.hidden = true;
  const legend = document.createElement("div");
  legend.className = "legend";
  legend.hidden = true;
  const handles = document.createElement("div");
  handles.className = "handles";
  element.append(handles, head, message, legend);
  return element;
}

function options(app, chosen) {
  const groups = new Map();
  app.contents.forEach(({ id, label, group }, place) => {
    if (!groups.has(group)) {
      const list = document.createElement("optgroup");
      list.label = group;
      groups.set(group, list);
    }
    const option = new Option(place < 9 ? `${label}  (${place + 1})` : label, id, false, id === chosen);
    groups.get(group).append(option);
  });
  return [...groups.values()];
}

// Bring captions, messages, legends and handles in line with what is drawn.
export function tellPanes(app, blocks) {
  app.paneElements.forEach((element) => {
    const content = element.dataset.content;
    const sequence = sequenceOf(app, content);
    const number = numberFor(app, sequence, app.loader.shown.at);
    const block = blocks[sequence.id];
    element.classList.toggle("active", Number(element.dataset.place) === app.state.active && app.paneElements.length > 1);
    element.querySelector(".caption").textContent = number === null ? "" : captionOf(app, sequence, number, block) + sparedOf(app, content, blocks);
    tellMessage(element.querySelector(".message"), messageOf(sequence, number, block));
    tellLegend(app, element.querySelector(".legend"), content, sequence);
    tellHandles(app, element, content);
  });
}

function captionOf(app, sequence, number, block) {
  const words = [String(number)];
  if (app.index.sequences.some(({ id }) => resultOf(id))) words.unshift(sequence.group);
  if (block?.facts.round !== undefined) words.push(`round ${block.facts.round}`);
  if (sequence.kind === "normals" || sequence.kind === "position") {
    words.push(sequence.space === "camera" ? "" : `${sequence.space} space`, sequence.y === "down" ? "y down" : "");
  }
  return words.filter(Boolean).join(" · ");
}

// Say why a picture is not hatched of which next to nothing is trusted.
function sparedOf(app, content, blocks) {
  const share = sparedShare(app, content, blocks);
  if (share === null) return "";
  return ` · ${share ? `only ${(100 * share).toPrecision(1)} %` : "nothing"} is trusted, so nothing is hatched (V does)`;
}

function messageOf(sequence, number, block) {
  if (number === null) return `${sequence.label} has no picture of this number.`;
  if (block?.missing) return block.missing;
  return !block && sequence.slow ? "Being computed from the clip …" : "";
}

function tellMessage(element, text) {
  element.hidden = !text;
  if (element.textContent !== text) element.textContent = text;
}

function tellLegend(app, element, content, sequence) {
  const range = app.ranges.get(sequence.family);
  const shown = !isRelit(content) && (sequence.kind === "mask" || (sequence.kind === "heat" && range));
  element.hidden = !shown;
  if (!shown) return;
  const text = sequence.kind === "mask" ? "mask" : `${range} ${sequence.unit}`;
  if (element.dataset.of === text) return;
  element.dataset.of = text;
  if (sequence.kind === "mask") {
    element.replaceChildren(key("valid", "trusted"), key("invalid", "not trusted"));
    return;
  }
  const ramp = document.createElement("canvas");
  ramp.width = 128;
  ramp.height = 1;
  const pen = ramp.getContext("2d");
  for (let x = 0; x < 128; x += 1) {
    pen.fillStyle = `rgb(${colourAt(paletteOf(sequence), x / 127).map(Math.round).join(",")})`;
    pen.fillRect(x, 0, 1, 1);
  }
  element.replaceChildren(words(figure(range[0], sequence.unit)), ramp, words(figure(range[1], sequence.unit)));
}

function key(kind, text) {
  const element = words(text);
  element.className = `key ${kind}`;
  return element;
}

function words(text) {
  const element = document.createElement("span");
  element.textContent = text;
  return element;
}

export function figure(value, unit = "") {
  const text = Math.abs(value) >= 1000 || (value !== 0 && Math.abs(value) < 0.001) ? value.toExponential(2) : String(Number(value.toPrecision(3)));
  return unit ? `${text}${unit === "°" ? "" : " "}${unit}` : text;
}

// Where the disc of light directions lies in a pane: middle and radius in CSS pixels from the pane's top left.
export function discOf(app, element) {
  const box = element.getBoundingClientRect();
  const part = windowOf(app, box.width, box.height);
  const middle = [(0.5 - part.x) / part.width * box.width, (0.5 - part.y) / part.height * box.height];
  const size = Math.min(app.index.width_px, app.index.height_px) * part.scale;
  return { middle, radius: HANDLE_REACH * size };
}

function firstRelit(app) {
  return app.paneElements.find((element) => isRelit(element.dataset.content));
}

function tellHandles(app, element, content) {
  const layer = element.querySelector(".handles");
  const lights = isRelit(content) ? app.state.lights : [];
  const knobs = layer.getElementsByClassName("knob");
  while (knobs.length > lights.length) knobs[knobs.length - 1].remove();
  while (knobs.length < lights.length) layer.append(handle(app));
  const { middle, radius } = discOf(app, element);
  tellDisc(layer, lights.length > 0, middle, radius);
  layer.querySelector(".disc")?.setAttribute("data-tip", app.state.dragged || element !== firstRelit(app) ? "" : "drag the light");
  lights.forEach((light, place) => {
    const knob = knobs[place];
    knob.dataset.light = place;
    knob.style.left = `${middle[0] + light.direction[0] * radius}px`;
    knob.style.top = `${middle[1] - light.direction[1] * radius}px`;
    knob.style.setProperty("--ink", light.colour);
    knob.classList.toggle("chosen", place === app.state.selected);
    knob.textContent = light.place + 1;
    const [x, y] = light.direction;
    knob.setAttribute("aria-label", `${light.name}, ${Math.round(x * 100)} % right, ${Math.round(y * 100)} % up; arrow keys move it`);
  });
}

// The rim of the disc on which lights are dragged: there they graze the surface.
function tellDisc(layer, wanted, [across, down], radius) {
  let disc = layer.querySelector(".disc");
  if (!wanted) {
    disc?.remove();
    return;
  }
  if (!disc) {
    disc = document.createElement("div");
    disc.className = "disc";
    layer.prepend(disc);
  }
  Object.assign(disc.style, { left: `${across - radius}px`, top: `${down - radius}px`, width: `${2 * radius}px`, height: `${2 * radius}px` });
}

function handle(app) {
  const knob = document.createElement("button");
  knob.type = "button";
  knob.className = "knob";
  knob.addEventListener("focus", () => app.change({ selected: Number(knob.dataset.light) }));
  return knob;
}
