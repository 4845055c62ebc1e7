// When every flash fired: which light each row of each frame saw, over the whole clip and near the shown picture.
import { DARK_INK, INKS } from "./palettes.js";
import { nearest } from "./looks.js";

const COLUMN_PX = 34;
const OVERVIEW_PX = 26;
const STRAY_PX = 44;
const GAP_PX = 8;
const SOFT = "#a8a8a8";

export class TimingView {
  constructor(app, record) {
    this.app = app;
    this.record = record;
    this.names = [...new Set(record.flashes.map(nameOf))].filter((name) => name !== "dark");
    this.last = Math.ceil((endOf(record.flashes[record.flashes.length - 1]) ?? 0) / record.frame_period_s);
    this.stray = strayOf(record.flashes);
    this.canvas = document.getElementById("timing-diagram");
    this.canvas.addEventListener("click", (event) => this.goTo(event));
    this.facts();
  }

  ink(name) {
    return name === "dark" ? DARK_INK : INKS[this.names.indexOf(name) % INKS.length];
  }

  facts() {
    const { record } = this;
    const complete = record.flashes.filter((flash) => flash.complete).length;
    const dropped = record.dropped_frames.map((hole) => `${hole.count} after ${hole.after}`);
    const rows = [
      ["Flashes", `${record.flashes.length}, ${complete} complete`],
      ["Sure to", `${Number(record.phase_error_rows.toPrecision(2))} row`],
      ["Strobe's clock", `${record.clock_offset_ppm >= 0 ? "+" : ""}${record.clock_offset_ppm.toFixed(1)} ppm`],
      ["Order", { marker: "from the dark slot", rig: "from the rig", given: "given", guess: "a guess" }[record.order]],
      ["Row time", `${(record.row_time_s * 1e6).toFixed(2)} µs`],
      ["Exposure", `${(record.exposure_s * 1e3).toFixed(3)} ms`],
      ["Dropped", dropped.join(", ") || "none"],
      ["Repeated", (record.repeated_frames ?? []).join(", ") || "none"],
    ];
    const list = document.createElement("dl");
    list.className = "facts";
    for (const [name, value] of rows) list.append(made("dt", name), made("dd", value));
    const inks = made("p", "");
    inks.className = "inks";
    for (const name of [...this.names, "dark"]) {
      const key = made("span", name);
      key.style.setProperty("--ink", this.ink(name));
      inks.append(key);
    }
    const notes = record.order_note ? [made("p", record.order_note)] : [];
    document.getElementById("timing-facts").replaceChildren(inks, list, ...notes);
  }

  shownTime() {
    return this.app.master.times_s[this.app.loader.shown.at];
  }

  goTo(event) {
    const box = this.canvas.getBoundingClientRect();
    const x = event.clientX - box.left;
    const over = event.clientY - box.top < OVERVIEW_PX + STRAY_PX + GAP_PX;
    const time = over ? x / box.width * this.last * this.record.frame_period_s
      : (this.firstColumn(box.width) + x / COLUMN_PX) * this.record.frame_period_s;
    this.app.go(nearest(this.app.master.times_s, time));
  }

  firstColumn(width) {
    const seen = width / COLUMN_PX;
    const middle = this.shownTime() / this.record.frame_period_s;
    return Math.max(Math.min(Math.floor(middle - seen / 2), Math.ceil(this.last - seen)), 0);
  }

  draw() {
    const ratio = devicePixelRatio;
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    const pen = this.canvas.getContext("2d");
    pen.scale(ratio, ratio);
    pen.font = "11px system-ui, sans-serif";
    this.overview(pen, width);
    this.strayLine(pen, width, OVERVIEW_PX + 2);
    const top = OVERVIEW_PX + STRAY_PX + GAP_PX;
    this.rows(pen, width, top, height - top - 16);
  }

  overview(pen, width) {
    const scale = width / (this.last * this.record.frame_period_s);
    for (const flash of this.record.flashes) {
      pen.fillStyle = this.ink(nameOf(flash));
      pen.globalAlpha = flash.complete ? 1 : 0.4;
      pen.fillRect(flash.start_s * scale, 4, Math.max(flash.duration_s * scale, 1.5), OVERVIEW_PX - 8);
    }
    pen.globalAlpha = 1;
    const first = this.firstColumn(width) * this.record.frame_period_s * scale;
    pen.strokeStyle = SOFT;
    pen.strokeRect(first + 0.5, 1.5, Math.min(width / COLUMN_PX * this.record.frame_period_s * scale, width - first) - 1, OVERVIEW_PX - 3);
    pen.fillStyle = "#ffffff";
    pen.fillRect(this.shownTime() * scale - 1, 0, 2, OVERVIEW_PX + STRAY_PX);
  }

  // By how much flashes stray from a clock that runs straight.
  strayLine(pen, width, top) {
    const scale = width / (this.last * this.record.frame_period_s);
    const most = Math.max(...this.stray.map(Math.abs), 1e-9);
    const unit = 10 ** Math.ceil(Math.log10(most));
    const middle = top + STRAY_PX / 2;
    pen.fillStyle = "#3a3a3a";
    pen.fillRect(0, middle, width, 1);
    this.record.flashes.forEach((flash, place) => {
      pen.fillStyle = this.ink(nameOf(flash));
      pen.fillRect(flash.start_s * scale - 1, middle - this.stray[place] / unit * (STRAY_PX / 2 - 4) - 1, 3, 3);
    });
    pen.fillStyle = SOFT;
    pen.fillText(`strays from a straight clock, ±${Number((unit * 1e6).toPrecision(3))} µs`, 4, top + 10);
  }

  // One column a frame, rows downwards: bands where a row saw a flash, paler where it saw a part of it.
  rows(pen, width, top, height) {
    const { record } = this;
    const first = this.firstColumn(width);
    const count = Math.min(Math.ceil(width / COLUMN_PX), this.last - first + 1);
    const missing = this.missing();
    for (let column = 0; column < count; column += 1) {
      const frame = first + column;
      const x = column * COLUMN_PX;
      pen.fillStyle = "#2c2c2c";
      pen.fillRect(x + 1, top, COLUMN_PX - 2, height);
      for (const flash of record.flashes) this.band(pen, flash, frame, x, top, height);
      if (missing.has(frame)) cross(pen, x, top, height);
      pen.fillStyle = SOFT;
      if (frame % 2 === 0) pen.fillText(String(this.numberAt(frame)), x + 3, top + height + 12);
    }
    const now = this.shownTime() / record.frame_period_s - first;
    pen.fillStyle = "#ffffff";
    pen.fillRect(now * COLUMN_PX - 1, top - 3, 2, height + 6);
  }

  band(pen, flash, frame, x, top, height) {
    const { record } = this;
    const since = flash.start_s - frame * record.frame_period_s;
    const readout = Math.abs(record.row_time_s) * this.app.index.height_px;
    if (since > readout + record.exposure_s || since + flash.duration_s < 0) return;
    const share = (time) => (readout ? Math.min(Math.max(time / readout, 0), 1) : time > 0 ? 1 : 0);
    const spans = [[since - record.exposure_s, since + flash.duration_s, 0.35], [since + flash.duration_s - record.exposure_s, since, 1]];
    for (const [from, to, alpha] of spans) {
      const [low, high] = [share(from), share(to)];
      if (high <= low) continue;
      pen.globalAlpha = alpha;
      pen.fillStyle = this.ink(nameOf(flash));
      const y = record.row_time_s < 0 ? 1 - high : low;
      pen.fillRect(x + 1, top + y * height, COLUMN_PX - 2, (high - low) * height);
    }
    pen.globalAlpha = 1;
  }

  // The places in time at which frames are missing.
  missing() {
    const places = new Set();
    let shift = 0;
    for (const hole of this.record.dropped_frames) {
      const after = hole.after - (this.record.first_number ?? 1) + shift;
      for (let step = 1; step <= hole.count; step += 1) places.add(after + step);
      if (!hole.numbered) shift += hole.count;
    }
    return places;
  }

  numberAt(frame) {
    return frame + (this.record.first_number ?? 1);
  }
}

function nameOf(flash) {
  return Object.keys(flash.lights).filter((name) => flash.lights[name] > 0).join("+") || "dark";
}

function endOf(flash) {
  return flash && flash.start_s + flash.duration_s;
}

// Every flash's distance from the straight line through all that share its slot, in seconds.
function strayOf(flashes) {
  const stray = new Array(flashes.length).fill(0);
  for (const slot of new Set(flashes.map((flash) => flash.slot))) {
    const places = [...flashes.keys()].filter((place) => flashes[place].slot === slot);
    if (places.length < 3) continue;
    const meanX = places.reduce((sum, place) => sum + place, 0) / places.length;
    const meanY = places.reduce((sum, place) => sum + flashes[place].start_s, 0) / places.length;
    const spread = places.reduce((sum, place) => sum + (place - meanX) ** 2, 0);
    const slope = places.reduce((sum, place) => sum + (place - meanX) * (flashes[place].start_s - meanY), 0) / spread;
    for (const place of places) stray[place] = flashes[place].start_s - meanY - slope * (place - meanX);
  }
  return stray;
}

function cross(pen, x, top, height) {
  pen.strokeStyle = "#ffffff";
  pen.lineWidth = 2;
  pen.beginPath();
  pen.moveTo(x + 4, top + 4);
  pen.lineTo(x + COLUMN_PX - 4, top + height - 4);
  pen.moveTo(x + COLUMN_PX - 4, top + 4);
  pen.lineTo(x + 4, top + height - 4);
  pen.stroke();
  pen.lineWidth = 1;
}

function made(kind, text) {
  return Object.assign(document.createElement(kind), { textContent: text });
}
