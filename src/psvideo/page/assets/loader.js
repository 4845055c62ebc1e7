// Which place of the sequence is shown: the wanted one once all its pictures are there, one place after the other, so
// that something moves on the screen however fast the wanted place runs ahead.
import { MOST_BYTES, blockKey } from "./source.js";
import { needsOf, numberFor, sequenceOf, widthFor } from "./looks.js";

const AHEAD = 4;
const REST_MS = 300;
const RESTING_AT_ONCE = 2; // so that whoever moves on need not wait long for what was begun meanwhile
const RESTING_SHARE = 0.7; // of the memory for blocks, for places around the one that rests
const MOST_AROUND = 1000;

export class Loader {
  constructor(app, changed) {
    this.app = app;
    this.changed = changed;
    this.shown = { at: 0, blocks: {}, keys: {} };
    this.loading = null;
    this.arrivals = [];
    this.restTimer = 0;
    this.direction = 1;
    this.early = NaN;
  }

  // Say that the place, the panes or their sizes have changed. `moving`: more changes are likely at once.
  update({ moving = false } = {}) {
    clearTimeout(this.restTimer);
    if (moving) this.restTimer = setTimeout(() => this.update(), REST_MS);
    this.moving = moving;
    this.step();
  }

  // Blocks came: show what is whole.
  step() {
    const { app } = this;
    for (let turn = 0; turn < 2; turn += 1) {
      if (!this.loading) {
        const at = this.next();
        const keys = this.keysAt(at);
        if (this.shown.at === at && same(keys, this.shown.keys)) break;
        this.loading = { at, keys, ahead: this.keysAhead(at) };
      } else if (!this.moving && this.loading.at === app.state.at) {
        this.loading.keys = this.keysAt(app.state.at);
      }
      const missing = Object.values(this.loading.keys).filter((key) => !app.source.get(key));
      if (missing.length) {
        app.source.want([...missing, ...this.slowKeys()], this.loading.ahead);
        return;
      }
      this.show();
    }
    app.source.want(this.slowKeys(), this.keysAhead(app.state.at), this.quick() ? undefined : RESTING_AT_ONCE);
  }

  // The place to load now: the wanted one; while it runs, one on the way there that was asked for early, if there is any.
  next() {
    const { at } = this.app.state;
    const early = this.early;
    const onTheWay = (early - this.shown.at) * (at - early) >= 0 && early !== this.shown.at;
    return this.moving && !this.app.state.playing && onTheWay ? early : at;
  }

  show() {
    const { at, keys } = this.loading;
    const blocks = Object.fromEntries(Object.entries(keys).map(([id, key]) => [id, this.app.source.get(key)]));
    if (at !== this.shown.at) {
      this.direction = at < this.shown.at ? -1 : 1;
      this.arrivals.push(performance.now());
    }
    this.shown = { at, keys, blocks };
    this.loading = null;
    this.changed();
  }

  // How many other places were shown in the last second.
  rate() {
    const since = performance.now() - 1000;
    this.arrivals = this.arrivals.filter((time) => time > since);
    return this.arrivals.length;
  }

  // The keys of all pictures that the panes need at a place, by the sequence's id, but for those that are slow to make.
  keysAt(at, quick = this.quick()) {
    const ids = new Set(this.app.panes().flatMap((content) => needsOf(this.app, content)));
    return this.keysOf(at, [...ids].filter((id) => !this.app.sequences.get(id).slow), quick);
  }

  quick() {
    return this.moving || this.app.state.playing;
  }

  slowKeys() {
    if (this.moving || this.app.state.playing) return [];
    return Object.values(this.keysOf(this.app.state.at, this.slowIds(), false));
  }

  slowIds() {
    return this.app.panes().filter((content) => sequenceOf(this.app, content).slow);
  }

  // The blocks that can be drawn now: those shown, and slow ones as far as they are there.
  blocks() {
    const slow = this.keysOf(this.shown.at, this.slowIds(), false);
    const found = Object.entries(slow).map(([id, key]) => [id, this.app.source.get(key)]);
    return { ...this.shown.blocks, ...Object.fromEntries(found.filter(([, block]) => block)) };
  }

  // What is likely to be wanted next: while the place runs, where it will be by then; in play, what follows; at rest, all
  // around it that memory holds.
  keysAhead(at) {
    const { app } = this;
    const running = this.moving && !app.state.playing;
    const stride = at - this.shown.at;
    this.early = running ? at + stride : NaN;
    const places = running ? [this.early] : app.state.playing ? this.following(at) : this.around(at);
    const count = app.master.numbers.length;
    return places.filter((place) => place >= 0 && place < count).flatMap((place) => Object.values(this.keysAt(place, true)));
  }

  following(at) {
    const count = this.app.master.numbers.length;
    return Array.from({ length: AHEAD }, (_, step) => (at + this.direction * (step + 1) + count) % count);
  }

  around(at) {
    const blocks = Object.values(this.shown.blocks);
    const bytes = Math.max(blocks.reduce((sum, block) => sum + block.bytes, 0), 1);
    const reach = Math.min(RESTING_SHARE * MOST_BYTES / bytes, MOST_AROUND, 2 * this.app.master.numbers.length) / 2;
    return Array.from({ length: Math.floor(reach) }, (_, step) => [at + step + 1, at - step - 1]).flat();
  }

  // Whether a place could be shown at once.
  holds(at) {
    return Object.values(this.keysAt(at, true)).every((key) => this.app.source.kept.has(key));
  }

  keysOf(at, ids, quick) {
    const { app } = this;
    const width = widthFor(app, app.paneWidth(), quick);
    const keys = {};
    for (const id of ids) {
      const number = numberFor(app, app.sequences.get(id), at);
      if (number !== null) keys[id] = blockKey(id, number, width, quick && !app.fixedWidth && !app.sequences.get(id).slow);
    }
    return keys;
  }
}

function same(one, other) {
  const ids = Object.keys(one);
  return ids.length === Object.keys(other).length && ids.every((id) => one[id] === other[id]);
}
