// Lights that are put into the picture afterwards, and what a pixel looks like under them. The shader says the same.
//
// Axes are the camera's: x right, y up, z towards the camera. A distant light has a direction; a near one stands in that
// direction, at a distance from the subject's middle that is counted in widths of the picture, and has its stated
// strength there.

import { aroundOn } from "./around.js";

export const MOST_LIGHTS = 8;
const FIRST_PLACES = [[0.45, 0.5], [-0.7, 0.15], [0, -0.75], [0.75, -0.3], [-0.35, 0.8], [0.1, 0.1], [-0.6, -0.55], [0.6, 0.75]];
const FIRST_COLOURS = ["#ffffff", "#9cc8ff", "#ffb877", "#ffffff", "#ffd9b0", "#ffffff", "#c4dcff", "#ffffff"];

export function newLight(lights) {
  const free = [...FIRST_PLACES.keys()].find((place) => !lights.some((light) => light.place === place)) ?? 0;
  return { place: free, name: `Light ${free + 1}`, direction: directionAt(...FIRST_PLACES[free]),
    colour: FIRST_COLOURS[free], intensity: 1, near: false, distance: 0.8 };
}

// The direction of a light whose handle is at (x, y) on a disc of radius 1; beyond its rim it grazes the surface.
export function directionAt(x, y) {
  const radius = Math.hypot(x, y);
  if (radius >= 1) return [x / radius, y / radius, 0];
  return [x, y, Math.sqrt(1 - radius * radius)];
}

export function linearOf(hex) {
  return [1, 3, 5].map((start) => {
    const code = parseInt(hex.slice(start, start + 2), 16) / 255;
    return code <= 0.04045 ? code / 12.92 : ((code + 0.055) / 1.055) ** 2.4;
  });
}

export function srgbOf(linear) {
  const light = Math.min(Math.max(linear, 0), 1);
  return light <= 0.0031308 ? 12.92 * light : 1.055 * light ** (1 / 2.4) - 0.055;
}

// The lights as the shader takes them: direction and distance (0: distant), and colour times strength.
export function lightUniforms(lights) {
  const places = new Float32Array(4 * MOST_LIGHTS);
  const colours = new Float32Array(3 * MOST_LIGHTS);
  lights.forEach((light, index) => {
    places.set([...light.direction, light.near ? light.distance : 0], 4 * index);
    colours.set(linearOf(light.colour).map((value) => value * light.intensity), 3 * index);
  });
  return { count: lights.length, places, colours };
}

// Linear light of one pixel: albedo and normal as [x, y, z], the point in widths of the picture from its middle.
export function relitPixel(normal, albedo, point, uniforms, specular, exponent, around) {
  const length = Math.hypot(...normal);
  if (length < 0.5) return [0, 0, 0];
  const n = normal.map((value) => value / length);
  const light = around ? aroundOn(around, n).map((value, channel) => value * albedo[channel]) : [0, 0, 0];
  for (let index = 0; index < uniforms.count; index += 1) {
    const [x, y, z, distance] = uniforms.places.subarray(4 * index, 4 * index + 4);
    let l = [x, y, z];
    let strength = 1;
    if (distance > 0) {
      const away = l.map((value, axis) => value * distance - point[axis]);
      const reach = Math.max(Math.hypot(...away), 1e-4);
      l = away.map((value) => value / reach);
      strength = (distance / reach) ** 2;
    }
    const facing = n[0] * l[0] + n[1] * l[1] + n[2] * l[2];
    if (facing <= 0) continue;
    let shine = 0;
    if (specular > 0) {
      const half = [l[0], l[1], l[2] + 1];
      const size = Math.max(Math.hypot(...half), 1e-6);
      shine = specular * Math.max((n[0] * half[0] + n[1] * half[1] + n[2] * half[2]) / size, 0) ** exponent;
    }
    for (let channel = 0; channel < 3; channel += 1) {
      light[channel] += uniforms.colours[3 * index + channel] * strength * (albedo[channel] * facing + shine);
    }
  }
  return light;
}
