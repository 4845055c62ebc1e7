// Colours that people with any colour vision can distinguish: false colours whose lightness only rises, and a list of inks.

// After cividis (Nunez, Anderton and Renslow 2018): dark blue over grey to yellow.
export const CIVIDIS = [[0, 32, 77], [65, 77, 107], [124, 123, 120], [188, 175, 111], [255, 234, 70]];
// After viridis (Smith and van der Walt 2015).
export const VIRIDIS = [[68, 1, 84], [71, 44, 122], [59, 81, 139], [44, 113, 142], [33, 144, 141], [39, 173, 129],
  [92, 200, 99], [170, 220, 50], [253, 231, 37]];
// Okabe and Ito's inks, without black; dark slots are grey.
export const INKS = ["#e69f00", "#56b4e9", "#009e73", "#f0e442", "#0072b2", "#d55e00", "#cc79a7"];
export const DARK_INK = "#6e6e6e";
export const VALID = [0.88, 0.87, 0.82];
export const INVALID = [0.11, 0.22, 0.42];

// The colour at a share from 0 to 1 of a palette, 0 to 255.
export function colourAt(palette, share) {
  const place = Math.min(Math.max(share, 0), 1) * (palette.length - 1);
  const low = Math.min(Math.floor(place), palette.length - 2);
  return palette[low].map((value, channel) => value + (palette[low + 1][channel] - value) * (place - low));
}

export function paletteOf(sequence) {
  return sequence.from_zero ? CIVIDIS : VIRIDIS;
}

// 256 colours in a row as bytes, for a texture.
export function paletteBytes(palette) {
  const bytes = new Uint8Array(256 * 4);
  for (let index = 0; index < 256; index += 1) bytes.set([...colourAt(palette, index / 255), 255], index * 4);
  return bytes;
}
