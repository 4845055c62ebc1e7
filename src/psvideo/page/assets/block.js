// Blocks of pixels as the server and the single file give them: see page/picture.py for the layout.

const MAGIC = 0x42565350; // "PSVB", little endian

export function parseBlock(buffer) {
  const head = new DataView(buffer);
  if (head.getUint32(0, true) !== MAGIC) throw new Error("this is no block of pixels");
  const length = head.getUint32(4, true);
  const facts = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 8, length)));
  if (facts.missing !== undefined) return { facts, missing: facts.missing, data: null, bytes: length };
  const Values = facts.type === "half" ? Uint16Array : Float32Array;
  const data = new Values(buffer, 8 + length);
  return { facts, missing: null, data, bytes: data.byteLength, width: facts.width, height: facts.height,
    channels: facts.channels, half: facts.type === "half" };
}

export function missingBlock(message) {
  return { facts: { missing: message }, missing: message, data: null, bytes: 0 };
}

const HALVES = new Float32Array(65536); // every half float's value, made once
for (let code = 0; code < 65536; code += 1) {
  const sign = code & 0x8000 ? -1 : 1;
  const exponent = (code >> 10) & 31;
  const fraction = code & 1023;
  HALVES[code] = exponent === 0 ? sign * fraction * 2 ** -24
    : exponent === 31 ? (fraction ? NaN : sign * Infinity) : sign * (1 + fraction / 1024) * 2 ** (exponent - 15);
}

export function valueAt(block, index) {
  return block.half ? HALVES[block.data[index]] : block.data[index];
}

// The values of the pixel at (u, v), both 0 to 1 from the top left; grey gives one value.
export function pixelAt(block, u, v) {
  const col = Math.min(Math.max(Math.floor(u * block.width), 0), block.width - 1);
  const row = Math.min(Math.max(Math.floor(v * block.height), 0), block.height - 1);
  const start = (row * block.width + col) * block.channels;
  return Array.from({ length: block.channels }, (_, channel) => valueAt(block, start + channel));
}

// The values below which the given shares of all samples that are not 0 lie; [] where there are none.
export function percentiles(block, shares) {
  const values = [];
  const step = Math.max(1, Math.floor(block.data.length / 60000));
  for (let index = 0; index < block.data.length; index += step) {
    const value = valueAt(block, index);
    if (value !== 0) values.push(value);
  }
  values.sort((a, b) => a - b);
  return values.length ? shares.map((share) => values[Math.min(values.length - 1, Math.floor(share * values.length))]) : [];
}
