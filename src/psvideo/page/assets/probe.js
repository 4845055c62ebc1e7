// The pixel under the pointer: what every shown quantity says there, and what the new lights make of it.
import { pixelAt } from "./block.js";
import { lightUniforms, relitPixel } from "./lights.js";
import { isRelit, lookOf, resultOf, windowOf } from "./looks.js";
import { figure } from "./panes.js";
import { product } from "./matrix.js";

// The place in the picture, in shares of it, that lies under a pointer over a pane; null outside of the picture.
export function placeUnder(app, element, event) {
  const box = element.getBoundingClientRect();
  const part = windowOf(app, box.width, box.height);
  const u = part.x + (event.clientX - box.left) / box.width * part.width;
  const v = part.y + (event.clientY - box.top) / box.height * part.height;
  return u >= 0 && u < 1 && v >= 0 && v < 1 ? [u, v] : null;
}

export function tellPixel(app, place) {
  const list = document.getElementById("pixel");
  if (!place) {
    list.textContent = "Move over a picture.";
    return;
  }
  const [u, v] = place;
  const rows = [["Column, row", `${Math.floor(u * app.index.width_px)}, ${Math.floor(v * app.index.height_px)}`]];
  const blocks = app.loader.blocks();
  for (const [id, block] of Object.entries(blocks)) {
    if (!block?.data) continue;
    const sequence = app.sequences.get(id);
    rows.push([named(app, sequence.label, sequence.group), pixelAt(block, u, v).map((value) => figure(value)).join("  ") + (sequence.unit ? ` ${sequence.unit}` : "")]);
  }
  for (const content of new Set(app.panes().filter(isRelit))) {
    const look = lookOf(app, content, blocks);
    if (!look) continue;
    const light = relitOf(look, u, v, lightUniforms(app.state.lights)).map((value) => figure(value));
    rows.push([named(app, "Relit", look.sequence.group), light.join("  ")]);
  }
  list.replaceChildren(...rows.flatMap(([name, value]) => [term("dt", name), term("dd", value)]));
}

// What is shown of which result, where there are several.
function named(app, label, group) {
  return app.index.sequences.some(({ id }) => resultOf(id)) ? `${label}, ${group}` : label;
}

function term(kind, text) {
  return Object.assign(document.createElement(kind), { textContent: text });
}

// Linear light of the pixel at (u, v), as the shader computes it.
export function relitOf(look, u, v, lights) {
  const { normals, albedo } = look.blocks;
  const ySign = look.sequence.y === "down" ? -1 : 1;
  const [x, y, z] = pixelAt(normals, u, v);
  const normal = product(look.toCamera, [x, y * ySign, z]);
  const ground = albedo ? pixelAt(albedo, u, v) : [0.7];
  return relitPixel(normal, ground.length === 1 ? Array(3).fill(ground[0]) : ground, pointOf(look, u, v, ySign), lights, look.specular, look.exponent, look.around);
}

function pointOf(look, u, v, ySign) {
  const { place } = look;
  const across = u - 0.5;
  const up = (0.5 - v) * look.aspect;
  if (place.kind === 0) return [across, up, 0];
  const [x, y, z] = pixelAt(look.blocks[place.id], u, v);
  if (place.kind === 2) return [across, up, x === 0 ? 0 : -(x - place.middle[0]) / place.middle[0] * place.scale];
  const seen = product(look.toCamera, [x - look.origin[0], y * ySign - look.origin[1], z - look.origin[2]]);
  return seen.map((value, axis) => (value - place.middle[axis]) / place.scale);
}
