// Where there is no WebGL2: the same panes, painted by the processor from small pictures.
import { valueAt } from "./block.js";
import { INVALID, VALID, colourAt, paletteOf } from "./palettes.js";
import { lightUniforms, srgbOf } from "./lights.js";
import { relitOf } from "./probe.js";
import { BACKGROUND } from "./stage.js";

export const FLAT_WIDTH = 320;

export class FlatStage {
  constructor(canvas) {
    this.canvas = canvas;
    this.pen = canvas.getContext("2d");
    this.small = document.createElement("canvas");
  }

  resize(width, height) {
    if (this.canvas.width !== width) this.canvas.width = width;
    if (this.canvas.height !== height) this.canvas.height = height;
  }

  clear() {
    this.pen.fillStyle = `rgb(${BACKGROUND.map((value) => Math.round(255 * value)).join(",")})`;
    this.pen.fillRect(0, 0, this.canvas.width, this.canvas.height);
  }

  draw(look, rect, cut) {
    const block = look.blocks[look.main];
    this.small.width = block.width;
    this.small.height = block.height;
    this.small.getContext("2d").putImageData(painted(look, block), 0, 0);
    const { x, y, width, height } = look.window;
    this.pen.save();
    this.pen.beginPath();
    this.pen.rect(cut.x, cut.y, cut.width, cut.height);
    this.pen.clip();
    this.pen.drawImage(this.small, rect.x - x / width * rect.width, rect.y - y / height * rect.height, rect.width / width, rect.height / height);
    this.pen.restore();
  }
}

function painted(look, block) {
  const image = new ImageData(block.width, block.height);
  const lights = lightUniforms(look.lights);
  for (let row = 0, pixel = 0; row < block.height; row += 1) {
    for (let col = 0; col < block.width; col += 1, pixel += 1) {
      const at = pixel * block.channels;
      const value = [0, 1, 2].map((channel) => valueAt(block, at + (block.channels === 1 ? 0 : channel)));
      const shown = coloured(look, value, (col + 0.5) / block.width, (row + 0.5) / block.height, lights);
      image.data.set([255 * shown[0], 255 * shown[1], 255 * shown[2], 255], 4 * pixel);
    }
  }
  return image;
}

function coloured(look, value, u, v, lights) {
  const chosen = (light) => {
    if (look.channels === 4) return Array(3).fill(0.2126 * light[0] + 0.7152 * light[1] + 0.0722 * light[2]);
    return look.channels ? Array(3).fill(light[look.channels - 1]) : light;
  };
  if (look.kind === "relit") return chosen(relitOf(look, u, v, lights)).map((light) => srgbOf(light * look.exposure));
  if (look.kind === "light") return chosen(value).map((light) => srgbOf(light * look.exposure));
  if (look.kind === "normals") return chosen(value.map((part) => 0.5 + 0.5 * part));
  if (look.kind === "mask") return INVALID.map((ink, channel) => ink + (VALID[channel] - ink) * value[0]);
  if (value.every((part) => part === 0)) return BACKGROUND;
  if (look.kind === "position") return chosen(value.map((part, axis) => 0.5 + (part - look.place.middle[axis]) / look.place.scale));
  const share = (value[0] - look.range[0]) / Math.max(look.range[1] - look.range[0], 1e-9);
  return colourAt(paletteOf(look.sequence), share).map((part) => part / 255);
}
