// The page: what is known, what is chosen, and what happens when something is chosen.
import { Source, fromPage, fromServer } from "./source.js";
import { Loader } from "./loader.js";
import { openStage } from "./stage.js";
import { RELIT, contentsOf, isRelit, lookOf, sparedShare, windowOf } from "./looks.js";
import { buildPanes, paneCount, tellPanes } from "./panes.js";
import { buildPanel, tellControls, tellLights } from "./panel.js";
import { MOST_LIGHTS, newLight } from "./lights.js";
import { listenToPointers } from "./gestures.js";
import { buildHelp, listenToKeys } from "./keys.js";
import { listenToTransport, playedRate, tellTransport } from "./transport.js";
import { placeUnder, tellPixel } from "./probe.js";
import { TimingView } from "./timing.js";
import { FLAT_WIDTH, FlatStage } from "./flat.js";

const PIXELS_SHOW = 3;

class App {
  constructor(index, fetchBlock, fetchTiming) {
    this.index = index;
    this.fetchTiming = fetchTiming;
    this.timing = null;
    this.sequences = new Map(index.sequences.map((sequence) => [sequence.id, sequence]));
    this.numbers = new Map(index.sequences.map((sequence) => [sequence.id, new Set(sequence.numbers)]));
    this.master = index.sequences[0];
    this.contents = contentsOf(index);
    this.viewer = document.getElementById("viewer");
    this.canvas = document.getElementById("picture");
    this.bases = new Map(); // exposures, ranges and places are found once and kept for the whole clip
    this.ranges = new Map();
    this.places = new Map();
    this.faults = new Set();
    this.mostWidth = Infinity;
    this.state = firstState(this);
    this.source = new Source(fetchBlock, (key, block) => this.arrived(key, block));
    this.loader = new Loader(this, () => this.draw());
    this.stage = openStage(this.canvas) ?? this.flat();
    this.drawing = false;
  }

  start() {
    buildPanel(this);
    buildPanes(this);
    buildHelp();
    listenToTransport(this);
    listenToPointers(this);
    listenToKeys(this);
    listenToBar(this);
    new ResizeObserver(() => {
      this.loader.update({ moving: true });
      this.draw();
    }).observe(this.viewer);
    this.canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    this.canvas.addEventListener("webglcontextrestored", () => {
      this.stage.build();
      this.draw();
    });
    this.loader.update({ moving: true }); // something to see first, sharp a moment later
    this.draw();
  }

  flat() {
    this.mostWidth = FLAT_WIDTH;
    notice("This browser shows no WebGL2, so pictures are small and painted by the processor. Switch hardware acceleration on in its settings, or open this page in another browser: current Firefox, Chrome, Edge and Safari have WebGL2.");
    return new FlatStage(this.canvas);
  }

  // What the panes show, and how wide the widest of them is in the screen's own pixels.
  panes() {
    return this.state.contents.slice(0, paneCount(this.state.layout));
  }

  paneWidth() {
    const across = this.state.layout === "four" || (this.state.layout === "two" && !this.stacked()) ? 2 : 1;
    return this.viewer.clientWidth * devicePixelRatio / across;
  }

  // Two pictures stand side by side or on each other, whichever shows them larger.
  stacked() {
    const [wide, high] = [this.viewer.clientWidth / this.index.width_px, this.viewer.clientHeight / this.index.height_px];
    return Math.min(wide, high / 2) > Math.min(wide / 2, high);
  }

  change(patch) {
    Object.assign(this.state, patch);
    this.loader.update({ moving: "zoom" in patch });
    this.draw();
  }

  go(at) {
    const last = this.master.numbers.length - 1;
    const wanted = Math.min(Math.max(at, 0), last);
    this.playedFrom = null;
    if (wanted !== this.state.at) this.run(wanted);
  }

  // Go to a place: nothing is drawn again until its pictures are there.
  run(at) {
    this.state.at = at;
    this.loader.update({ moving: true });
    if (this.loader.slowIds().length) this.draw();
    this.tellSoon();
  }

  tellSoon() {
    this.telling ||= requestAnimationFrame(() => {
      this.telling = 0;
      tellTransport(this);
    });
  }

  play(playing) {
    this.playedFrom = null;
    this.change({ playing });
    if (playing) requestAnimationFrame((now) => this.tick(now));
    else this.loader.update({ moving: true });
  }

  tick(now) {
    if (!this.state.playing) return;
    this.playedFrom ??= { time: now, at: this.state.at };
    const steps = Math.floor((now - this.playedFrom.time) / 1000 * playedRate(this.index));
    const at = (this.playedFrom.at + steps) % this.master.numbers.length;
    if (at !== this.state.at) this.run(at);
    requestAnimationFrame((next) => this.tick(next));
  }

  showIn(place, content) {
    const contents = [...this.state.contents];
    contents[place] = content;
    this.change({ contents, active: place });
    buildPanes(this);
    this.draw();
  }

  layOut(layout) {
    this.change({ layout, active: Math.min(this.state.active, paneCount(layout) - 1) });
    buildPanes(this);
    this.loader.update();
    this.draw();
  }

  swap() {
    const [first, second, ...rest] = this.state.contents;
    this.change({ contents: [second, first, ...rest] });
    buildPanes(this);
    this.draw();
  }

  beforeAndAfter() {
    const before = this.index.sequences.find((sequence) => sequence.id.startsWith("hudon2015-"));
    const after = before && this.sequences.get(before.id.replace("hudon2015-", "weights-"));
    if (!after) return;
    const contents = [before.id, after.id, ...this.state.contents.slice(2)];
    this.change({ contents, layout: this.state.layout === "wipe" ? "two" : "wipe" });
    buildPanes(this);
    this.loader.update();
    this.draw();
  }

  addLight() {
    if (this.state.lights.length >= MOST_LIGHTS || !this.sequences.has("normals")) return;
    const lights = [...this.state.lights, newLight(this.state.lights)];
    this.change({ lights, selected: lights.length - 1 });
  }

  removeLight(place) {
    const lights = this.state.lights.filter((_, other) => other !== place);
    this.change({ lights, selected: Math.max(Math.min(place, lights.length - 1), 0) });
  }

  changeLight(place, patch) {
    const lights = this.state.lights.map((light, other) => (other === place ? { ...light, ...patch } : light));
    this.change({ lights });
  }

  // Whether what is not valid is hatched in what is shown.
  marks() {
    const blocks = this.loader.blocks();
    return this.state.markInvalid && this.panes().every((content) => sparedShare(this, content, blocks) === null);
  }

  mark(markInvalid) {
    this.change({ markInvalid, markChosen: true });
  }

  expose() {
    this.bases.clear();
    this.ranges.clear();
    this.places.clear();
    this.change({ exposure: 0 });
  }

  togglePanel() {
    document.body.classList.toggle("no-panel");
    document.getElementById("panel-button").setAttribute("aria-pressed", String(!document.body.classList.contains("no-panel")));
  }

  async toggleTiming() {
    if (!this.index.timing) return;
    const section = document.getElementById("timing");
    section.hidden = !section.hidden;
    document.getElementById("timing-button").setAttribute("aria-pressed", String(!section.hidden));
    if (!section.hidden && !this.timing) await this.readTiming();
    this.draw();
  }

  async readTiming() {
    const facts = document.getElementById("timing-facts");
    facts.textContent = "Finding the flashes …";
    const record = await this.fetchTiming();
    if (record.missing) facts.textContent = record.missing;
    else this.timing = new TimingView(this, record);
  }

  arrived(key, block) {
    if (block.missing) this.faulty(key);
    this.loader.step();
    if (this.loader.slowIds().length) this.draw();
    this.tellSoon();
  }

  faulty(key) {
    const [id, rest] = key.split("/");
    if (this.sequences.get(id).slow) return;
    const number = Number(rest.split("?")[0]);
    if (this.sequences.get(id).timeline === this.master.timeline) this.faults.add(this.master.numbers.indexOf(number));
  }

  draw() {
    if (this.drawing) return;
    this.drawing = true;
    requestAnimationFrame(() => {
      this.drawing = false;
      this.drawNow();
    });
  }

  drawNow() {
    const blocks = this.loader.blocks();
    const ratio = devicePixelRatio;
    this.viewer.dataset.stacked = this.stacked() ? "yes" : "no";
    const whole = this.viewer.getBoundingClientRect();
    this.stage.resize(Math.round(whole.width * ratio), Math.round(whole.height * ratio));
    this.stage.clear();
    this.paneElements.forEach((element, place) => {
      const look = lookOf(this, element.dataset.content, blocks);
      if (look === null) return;
      const box = element.getBoundingClientRect();
      const rect = scaled({ x: box.left - whole.left, y: box.top - whole.top, width: box.width, height: box.height }, ratio);
      look.quick = this.loader.quick(); // software rendering takes half as long without mixing neighbours
      look.window = windowOf(this, box.width, box.height);
      look.sharp = this.state.zoom > 1 && rect.width / (look.window.width * this.index.width_px) >= PIXELS_SHOW; // pixels as they are, not mixed
      this.stage.draw(look, rect, this.cutOf(rect, place));
    });
    tellPanes(this, blocks);
    tellLights(this);
    tellControls(this);
    tellTransport(this);
    this.tellBar();
    if (this.timing && !document.getElementById("timing").hidden) this.timing.draw();
    document.body.dataset.shown = this.master.numbers[this.loader.shown.at];
    document.body.dataset.ready = Object.keys(blocks).length > 0;
  }

  // In a wipe, the second pane is cut off left of the line.
  cutOf(rect, place) {
    if (this.state.layout !== "wipe" || place === 0) return rect;
    const left = Math.round(rect.width * this.state.wipe);
    return { ...rect, x: rect.x + left, width: rect.width - left };
  }

  tellBar() {
    for (const button of document.querySelectorAll("[data-layout]")) {
      if (button.tagName === "BUTTON") button.setAttribute("aria-pressed", String(button.dataset.layout === this.state.layout));
    }
    const line = document.getElementById("wipe");
    line.style.left = `${100 * this.state.wipe}%`;
    line.setAttribute("aria-valuenow", Math.round(100 * this.state.wipe));
  }

  // Say what lies under the pointer.
  pointAt(element, event) {
    this.under = element ? placeUnder(this, element, event) : null;
    tellPixel(this, this.under);
  }

  // Linear light of the relit picture that is shown, as floats; for whoever wants numbers.
  relitValues(content = RELIT) {
    const look = lookOf(this, content, this.loader.blocks());
    return this.stage.relitValues(look);
  }
}

function scaled(rect, ratio) {
  const [x, y] = [Math.round(rect.x * ratio), Math.round(rect.y * ratio)];
  return { x, y, width: Math.round((rect.x + rect.width) * ratio) - x, height: Math.round((rect.y + rect.height) * ratio) - y };
}

function firstState(app) {
  const ids = app.contents.map(({ id }) => id);
  const relit = ids.filter(isRelit); // of several results, each one's
  const first = relit.length > 1 ? [...relit, ...ids.filter((id) => !isRelit(id))] : ids;
  const contents = [0, 1, 2, 3].map((place) => first[Math.min(place, first.length - 1)]);
  return { at: 0, playing: false, layout: relit.length > 2 ? "four" : ids.length > 1 && app.index.kind !== "clip" ? "two" : "one", contents, active: 0, wipe: 0.5, exposure: 0,
    channels: 0, lights: [newLight([])], selected: 0, specular: 0, exponent: 30, relief: 1, zoom: 1, centre: [0.5, 0.5],
    around: "none", aroundTurn: 0, aroundStrength: 0.6, dragged: false, markInvalid: app.sequences.has("valid"), markChosen: false };
}

function listenToBar(app) {
  for (const button of document.querySelectorAll(".choice button")) {
    button.addEventListener("click", () => app.layOut(button.dataset.layout));
  }
  document.getElementById("timing-button").hidden = !app.index.timing;
  document.getElementById("timing-button").addEventListener("click", () => app.toggleTiming());
  document.getElementById("panel-button").addEventListener("click", () => app.togglePanel());
  document.getElementById("help-button").addEventListener("click", () => document.getElementById("help").showModal());
  document.getElementById("report-link").hidden = !app.index.report;
  document.getElementById("name").textContent = app.index.name;
  document.title = `${app.index.name} – psvideo`;
  const verdict = document.getElementById("verdict");
  verdict.textContent = app.index.verdict;
  verdict.hidden = !app.index.verdict;
  verdict.classList.toggle("doubtful", app.index.findings.length > 0);
}

export function notice(text) {
  const element = document.getElementById("notice");
  element.textContent = text;
  element.hidden = !text;
}

async function begin() {
  const inside = document.getElementById("index");
  const index = inside ? JSON.parse(inside.textContent) : await (await fetch("index.json")).json();
  const record = () => JSON.parse(document.getElementById("timing-record").textContent);
  const asked = async () => (await fetch("timing.json")).json();
  const app = new App(index, inside ? fromPage : fromServer, inside ? record : asked);
  if (inside) app.fixedWidth = index.width_px;
  window.psvideo = app;
  app.start();
}

begin().catch((fault) => notice(`The page could not start: ${fault.message}`));
