// Light from all around: small high-range pictures of our own making, given by a few soft lobes over sky and ground.
//
// A matte surface sees of them what nine numbers a colour hold (R. Ramamoorthi and P. Hanrahan, "An efficient
// representation for irradiance environment maps", SIGGRAPH 2001, eq. 12 and 13). Axes are the camera's.

export const AROUND = {
  studio: { label: "Studio", sky: [0.12, 0.12, 0.13], ground: [0.05, 0.05, 0.05], lobes: [
    { at: [-0.7, 0.5, 0.5], colour: [4.2, 4.0, 3.7], sharp: 9 },
    { at: [0.85, 0.2, 0.35], colour: [0.9, 1.1, 1.5], sharp: 6 },
    { at: [0.1, 0.55, -0.8], colour: [2.4, 2.4, 2.6], sharp: 14 },
  ] },
  window: { label: "Window", sky: [0.16, 0.14, 0.12], ground: [0.1, 0.08, 0.06], lobes: [
    { at: [-0.95, 0.15, 0.25], colour: [5.0, 5.8, 7.0], sharp: 12 },
    { at: [0.6, -0.6, 0.5], colour: [0.5, 0.4, 0.3], sharp: 3 },
  ] },
  evening: { label: "Evening", sky: [0.22, 0.3, 0.5], ground: [0.09, 0.07, 0.06], lobes: [
    { at: [0.9, 0.12, 0.3], colour: [14, 7.0, 2.6], sharp: 30 },
    { at: [0.7, 0.2, -0.6], colour: [1.3, 0.7, 0.45], sharp: 4 },
  ] },
  overcast: { label: "Overcast", sky: [0.95, 1.0, 1.08], ground: [0.16, 0.15, 0.13], lobes: [] },
};

// The light that comes from a direction, before turning: [r, g, b].
export function radianceOf(name, direction) {
  const { sky, ground, lobes } = AROUND[name];
  const up = 0.5 + 0.5 * Math.tanh(4 * direction[1]);
  const light = sky.map((value, channel) => ground[channel] + (value - ground[channel]) * up);
  for (const { at, colour, sharp } of lobes) {
    const size = Math.hypot(...at);
    const facing = (direction[0] * at[0] + direction[1] * at[1] + direction[2] * at[2]) / size;
    const share = Math.exp(sharp * (facing - 1));
    for (let channel = 0; channel < 3; channel += 1) light[channel] += colour[channel] * share;
  }
  return light;
}

const ROWS = 32;
const SHARES = [1, 2 / 3, 2 / 3, 2 / 3, 1 / 4, 1 / 4, 1 / 4, 1 / 4, 1 / 4]; // of a degree that a matte surface sees
const SIZES = [0.282095, 0.488603, 0.488603, 0.488603, 1.092548, 1.092548, 0.315392, 1.092548, 0.546274];

function terms([x, y, z]) {
  return [1, y, z, x, x * y, y * z, 3 * z * z - 1, x * z, x * x - y * y];
}

// Nine colours (27 numbers) by which aroundOn gives the light of a white matte surface; null without surroundings.
export function aroundNumbers(name, turnDeg, strength) {
  if (!AROUND[name]) return null;
  const found = new Float32Array(27);
  const [cos, sin] = [Math.cos(turnDeg * Math.PI / 180), Math.sin(turnDeg * Math.PI / 180)];
  for (let row = 0; row < ROWS; row += 1) {
    const polar = Math.PI * (row + 0.5) / ROWS;
    const solid = Math.sin(polar) * (Math.PI / ROWS) ** 2;
    for (let col = 0; col < 2 * ROWS; col += 1) {
      const across = Math.PI * (col + 0.5) / ROWS;
      const [x, y, z] = [Math.sin(polar) * Math.sin(across), Math.cos(polar), Math.sin(polar) * Math.cos(across)];
      const light = radianceOf(name, [x, y, z]);
      terms([x * cos + z * sin, y, z * cos - x * sin]).forEach((term, place) => {
        const share = strength * SHARES[place] * SIZES[place] ** 2 * term * solid;
        for (let channel = 0; channel < 3; channel += 1) found[3 * place + channel] += share * light[channel];
      });
    }
  }
  return found;
}

// What a white matte surface with a normal shows: [r, g, b]. The shader says the same.
export function aroundOn(numbers, normal) {
  const light = [0, 0, 0];
  terms(normal).forEach((term, place) => {
    for (let channel = 0; channel < 3; channel += 1) light[channel] += numbers[3 * place + channel] * term;
  });
  return light.map((value) => Math.max(value, 0));
}
