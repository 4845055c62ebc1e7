// Where pictures come from, which of them are kept, and in what order they are fetched.
import { missingBlock, parseBlock } from "./block.js";

const GIGABYTES = navigator.deviceMemory ?? 3.2; // browsers that report it say 8 at most
export const MOST_BYTES = 0.2e9 * GIGABYTES;
const AT_ONCE = 4;

// `quick`: pixels are left out instead of averaged, which is made sooner; for what moves.
export function blockKey(id, number, width, quick) {
  return `${id}/${number}?width=${width}${quick ? "&quick=1" : ""}`;
}

export async function fromServer(key) {
  const answer = await fetch(`picture/${key}`);
  if (!answer.ok) return missingBlock((await answer.text()).trim());
  return parseBlock(await answer.arrayBuffer());
}

// Blocks that lie in the page itself: base64 of deflated bytes, low and high halves of the numbers apart.
export async function fromPage(key) {
  const found = document.getElementById(`block-${key.split("?")[0]}`);
  if (!found) return missingBlock("This picture is not in the file.");
  const packed = Uint8Array.from(atob(found.textContent.trim()), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return parseBlock(unshuffled(new Uint8Array(await new Response(stream).arrayBuffer())));
}

function unshuffled(bytes) {
  const length = new DataView(bytes.buffer).getUint32(4, true);
  const start = 8 + length;
  const half = JSON.parse(new TextDecoder().decode(bytes.subarray(8, start))).type === "half";
  const size = half ? 2 : 4;
  const count = (bytes.length - start) / size;
  const whole = new Uint8Array(bytes.length);
  whole.set(bytes.subarray(0, start));
  for (let part = 0; part < size; part += 1) {
    const from = start + part * count;
    for (let index = 0; index < count; index += 1) whole[start + index * size + part] = bytes[from + index];
  }
  return whole.buffer;
}

// Keeps blocks up to a number of bytes and fetches the wanted ones, the most urgent first.
export class Source {
  constructor(fetchBlock, arrived) {
    this.fetchBlock = fetchBlock;
    this.arrived = arrived;
    this.kept = new Map();
    this.underway = new Set();
    this.wanted = [];
    this.early = [];
    this.bytes = 0;
  }

  get(key) {
    const block = this.kept.get(key);
    if (block) {
      this.kept.delete(key); // and back in, as the one used last
      this.kept.set(key, block);
    }
    return block;
  }

  // Fetch some blocks at once, and then others that may be wanted soon, so many at a time.
  want(keys, early = [], earlyAtOnce = AT_ONCE) {
    const absent = (key) => !this.kept.has(key) && !this.underway.has(key);
    this.wanted = keys.filter(absent);
    this.early = early.filter(absent);
    this.earlyAtOnce = earlyAtOnce;
    this.fetchNext();
  }

  fetchNext() {
    while (this.wanted.length && this.underway.size < AT_ONCE) this.fetch(this.wanted.shift());
    while (!this.wanted.length && this.early.length && this.underway.size < this.earlyAtOnce) this.fetch(this.early.shift());
  }

  async fetch(key) {
    this.underway.add(key);
    let block;
    try {
      block = await this.fetchBlock(key);
    } catch (fault) {
      block = missingBlock(`Nothing came from psvideo (${fault.message}). Is the command still running?`);
    }
    this.underway.delete(key);
    this.keep(key, block);
    this.fetchNext();
    this.arrived(key, block);
  }

  keep(key, block) {
    this.kept.set(key, block);
    this.bytes += block.bytes;
    for (const [old, oldest] of this.kept) {
      if (this.bytes <= MOST_BYTES || old === key) break;
      this.kept.delete(old);
      this.bytes -= oldest.bytes;
    }
  }
}
