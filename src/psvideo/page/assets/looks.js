// From what is chosen to what is drawn: which pictures a pane needs, and how they are to be looked at.
import { percentiles, pixelAt } from "./block.js";
import { aroundNumbers } from "./around.js";
import { product, toCameraOf } from "./matrix.js";

export const RELIT = "relit";
const WIDTHS = [240, 480, 960, 1920, 3840, 7680];
const QUICK_WIDTH = 960;
const WHITE = 0.8;
const MOST_POINTS = 20000;
const LITTLE_TRUSTED = 0.05; // of the subject: hatching the rest would hide the picture

// Which of several results a content or a sequence belongs to: nothing for the first, "r2." for the second.
export function resultOf(id) {
  return id.match(/^r\d+\./)?.[0] ?? "";
}

// The same within its result: "normals" for "r2.normals".
export function bare(id) {
  return id.slice(resultOf(id).length);
}

export function isRelit(content) {
  return bare(content) === RELIT;
}

// The things that a pane can show, in the order of the keys 1 to 9.
export function contentsOf(index) {
  return index.sequences.flatMap(({ id, label, group }) => {
    const own = { id, label, group };
    return bare(id) === "normals" ? [{ id: resultOf(id) + RELIT, label: "Relit", group }, own] : [own];
  });
}

export function sequenceOf(app, content) {
  return app.sequences.get(isRelit(content) ? `${resultOf(content)}normals` : content);
}

// The ids of all sequences that a pane's content is made from.
export function needsOf(app, content) {
  const from = resultOf(content);
  const ids = isRelit(content) ? ["normals", "albedo", placeIdOf(app, from)] : [bare(content)];
  if (app.state.markInvalid && sequenceOf(app, content)?.hatched) ids.push("valid");
  return ids.filter(Boolean).map((id) => from + id).filter((id) => app.sequences.has(id));
}

// Where near lights find the surface: in the points, else in the depth, else on a plane.
function placeIdOf(app, from) {
  if (!app.state.lights.some((light) => light.near)) return null;
  return ["position", "depth"].find((id) => app.sequences.has(from + id)) ?? null;
}

// The number of a sequence's picture for a place on the scrubbed timeline; null where it has none.
export function numberFor(app, sequence, at) {
  const master = app.master;
  if (sequence.timeline === master.timeline) {
    const number = master.numbers[at];
    return app.numbers.get(sequence.id).has(number) ? number : null;
  }
  return sequence.numbers[nearest(sequence.times_s, master.times_s[at])] ?? null;
}

export function nearest(times, wanted) {
  let best = 0;
  for (let place = 1; place < times.length; place += 1) {
    if (Math.abs(times[place] - wanted) < Math.abs(times[best] - wanted)) best = place;
  }
  return best;
}

// The width of the pictures to ask for: no more than a pane can show, and at most the quick one while things move.
export function widthFor(app, paneWidth, quick) {
  const whole = app.index.width_px;
  if (app.fixedWidth) return app.fixedWidth;
  const shown = Math.min(paneWidth * app.state.zoom, quick ? QUICK_WIDTH : Infinity, app.mostWidth);
  const width = WIDTHS.find((candidate) => candidate >= 0.85 * shown) ?? WIDTHS[WIDTHS.length - 1];
  return Math.min(width, whole);
}

// The part of the picture that a pane shows, in shares of the picture.
export function windowOf(app, width, height) {
  const { width_px: across, height_px: down } = app.index;
  const scale = Math.min(width / across, height / down) * app.state.zoom;
  const seen = { width: width / (across * scale), height: height / (down * scale) };
  const centre = app.state.centre;
  return { x: centre[0] - seen.width / 2, y: centre[1] - seen.height / 2, ...seen, scale };
}

// The exposure that is kept for the whole clip: the brightest hundredth of the first picture seen lies at 0.8.
export function baseExposure(app, content, blocks) {
  const light = isRelit(content) ? `${resultOf(content)}albedo` : content;
  const family = app.sequences.get(light)?.family ?? light;
  if (!app.bases.has(family) && blocks[bare(light)]?.data) {
    const [bright] = percentiles(blocks[bare(light)], [0.99]);
    app.bases.set(family, bright > 1e-6 ? WHITE / bright : 1);
  }
  return app.bases.get(family) ?? 1;
}

export function rangeOf(app, sequence, blocks) {
  if (sequence.kind !== "heat") return [0, 1];
  if (!app.ranges.has(sequence.family) && blocks[bare(sequence.id)]?.data) {
    const [low, high] = percentiles(blocks[bare(sequence.id)], [0.02, 0.98]);
    if (high !== undefined) app.ranges.set(sequence.family, [sequence.from_zero ? 0 : low, high]);
  }
  return app.ranges.get(sequence.family) ?? [0, 1];
}

const PLANE = { id: null, kind: 0, middle: [0, 0, 0], scale: 1 };

// How a point of the surface is found for near lights, in widths of the picture from the subject's middle.
function placeOf(app, from, blocks, ySign, view) {
  const id = placeIdOf(app, from);
  if (!id || !blocks[id]?.data) return PLANE;
  const key = from + id;
  if (!app.places.has(key)) app.places.set(key, id === "position" ? measured(blocks[id], ySign, view) : relief(blocks[id]));
  const place = app.places.get(key);
  return id === "depth" ? { ...place, scale: app.state.relief } : place;
}

function relief(block) {
  const [middle] = percentiles(block, [0.5]);
  return { id: "depth", kind: 2, middle: [middle ?? 1, 0, 0], scale: 1 };
}

// The middle of the points, and how many of their units one width of the picture is, where they lie.
function measured(block, ySign, { toCamera, origin }) {
  const points = [];
  const step = Math.max(1, Math.floor(Math.sqrt(block.width * block.height / MOST_POINTS)));
  for (let row = 0; row < block.height; row += step) {
    for (let col = 0; col < block.width; col += step) {
      const [u, v] = [(col + 0.5) / block.width, (row + 0.5) / block.height];
      const [x, y, z] = pixelAt(block, u, v);
      if (x || y || z) points.push([u, product(toCamera, [x - origin[0], y * ySign - origin[1], z - origin[2]])]);
    }
  }
  if (points.length < 8) return PLANE;
  const middle = [0, 1, 2].map((axis) => median(points.map(([, point]) => point[axis])));
  const meanU = points.reduce((sum, [u]) => sum + u, 0) / points.length;
  const spread = points.reduce((sum, [u]) => sum + (u - meanU) ** 2, 0);
  const slopes = [0, 1, 2].map((axis) => points.reduce((sum, [u, point]) => sum + (u - meanU) * point[axis], 0) / spread);
  return { id: "position", kind: 1, middle, scale: Math.max(Math.hypot(...slopes), 1e-6) };
}

// Points as they stand in the file, for showing their numbers as colours.
function stored(app, from, block) {
  const key = `${from}position as stored`;
  if (!app.places.has(key)) app.places.set(key, measured(block, 1, toCameraOf(null)));
  return app.places.get(key);
}

function median(values) {
  values.sort((a, b) => a - b);
  return (values[(values.length - 1) >> 1] + values[values.length >> 1]) / 2;
}

let heldAround = { key: "", numbers: null };

// The light from all around as it is chosen, computed when it changes.
function aroundOf({ around, aroundTurn, aroundStrength }) {
  const key = `${around} ${aroundTurn} ${aroundStrength}`;
  if (heldAround.key !== key) heldAround = { key, numbers: aroundNumbers(around, aroundTurn, aroundStrength) };
  return heldAround.numbers;
}

const trustedShares = new WeakMap();

// The share of the subject that is trusted in a picture which is not hatched, because hatching would hide it; null where
// enough is trusted, or where the hatching was chosen.
export function sparedShare(app, content, blocks) {
  const from = resultOf(content);
  const sequence = sequenceOf(app, content);
  const [valid, main] = [blocks[`${from}valid`], blocks[sequence.id]];
  if (!app.state.markInvalid || app.state.markChosen || !sequence.hatched || !valid?.data || !main?.data) return null;
  if (!trustedShares.has(valid)) trustedShares.set(valid, trustedShare(valid, blocks[`${from}normals`]?.data ? blocks[`${from}normals`] : main));
  const share = trustedShares.get(valid);
  return share < LITTLE_TRUSTED ? share : null;
}

function trustedShare(valid, picture) {
  let [trusted, all] = [0, 0];
  const step = Math.max(1, Math.floor(Math.sqrt(valid.width * valid.height / MOST_POINTS)));
  for (let row = 0; row < valid.height; row += step) {
    for (let col = 0; col < valid.width; col += step) {
      const [u, v] = [(col + 0.5) / valid.width, (row + 0.5) / valid.height];
      const sure = pixelAt(valid, u, v)[0] > 0.5;
      trusted += sure;
      all += sure || pixelAt(picture, u, v).some((value) => value !== 0);
    }
  }
  return all ? trusted / all : 1;
}

// Everything that a stage needs to draw one pane; null where its picture is not there.
export function lookOf(app, content, blocks) {
  const sequence = sequenceOf(app, content);
  if (!blocks[sequence.id]?.data) return null;
  const from = resultOf(content);
  const own = Object.entries(blocks).filter(([id, block]) => block?.data && resultOf(id) === from);
  const present = Object.fromEntries(own.map(([id, block]) => [bare(id), block]));
  const main = bare(sequence.id);
  const kind = isRelit(content) ? RELIT : sequence.kind;
  const { exposure, channels, lights, specular, exponent, markInvalid } = app.state;
  const ySign = sequence.y === "down" ? -1 : 1;
  const view = toCameraOf(present[main].facts);
  const place = kind === RELIT ? placeOf(app, from, present, ySign, view) : PLANE;
  return {
    kind, sequence, from, main, blocks: present, channels, lights, exponent, aspect: app.index.height_px / app.index.width_px,
    place: kind === "position" ? stored(app, from, present[main]) : place, ...view,
    markInvalid: markInvalid && Boolean(present.valid) && sequence.hatched && sparedShare(app, content, blocks) === null,
    specular, around: kind === RELIT ? aroundOf(app.state) : null,
    exposure: 2 ** exposure * baseExposure(app, content, present),
    range: rangeOf(app, sequence, present),
  };
}
