// Going through the sequence: the slider, its marks, play, and the figures beside them.

const GO = "M4 2.5v11L13 8z";
const STOP = "M4 3h3v10H4zM9 3h3v10H9z";
const PHOTOGRAPHS_RATE = 4; // slow enough to see each

export function listenToTransport(app) {
  const on = (id, act) => document.getElementById(id).addEventListener("click", act);
  on("first", () => app.go(0));
  on("last", () => app.go(Infinity));
  on("back", () => app.go(app.state.at - 1));
  on("on", () => app.go(app.state.at + 1));
  on("play", () => app.play(!app.state.playing));
  const scrub = document.getElementById("scrub");
  scrub.max = app.master.numbers.length - 1;
  scrub.addEventListener("input", () => app.go(Number(scrub.value)));
  const number = document.getElementById("number");
  number.addEventListener("change", () => {
    const wanted = Number.parseInt(number.value, 10);
    if (Number.isFinite(wanted)) app.go(nearestNumber(app.master.numbers, wanted));
    number.blur();
    tellTransport(app);
  });
  number.addEventListener("keydown", (event) => event.key === "Enter" && number.blur());
}

function nearestNumber(numbers, wanted) {
  return numbers.reduce((best, number, at) => (Math.abs(number - wanted) < Math.abs(numbers[best] - wanted) ? at : best), 0);
}

// Results of no known rate, or slower than any film, which is only so because pictures were left out of an exported page
// or because they are of photographs: these have no time.
export function ofPhotographs(index) {
  return !index.fps || (!index.thinned && index.fps < 0.5);
}

// How many pictures a second are played.
export function playedRate(index) {
  return ofPhotographs(index) ? PHOTOGRAPHS_RATE : index.fps;
}

export function tellTransport(app) {
  const { state, master, loader } = app;
  const scrub = document.getElementById("scrub");
  scrub.value = state.at;
  scrub.setAttribute("aria-valuetext", `picture ${master.numbers[state.at]}`);
  const number = document.getElementById("number");
  if (document.activeElement !== number) number.value = master.numbers[state.at];
  const still = ofPhotographs(app.index);
  document.getElementById("clock").textContent = still ? counted(state.at, master.numbers.length) : `${master.times_s[state.at].toFixed(3)} s`;
  const play = document.getElementById("play");
  play.querySelector("path").setAttribute("d", state.playing ? STOP : GO);
  play.setAttribute("aria-label", state.playing ? "Stop" : "Play");
  const planned = app.index.fps;
  const shown = loader.rate();
  const rate = state.playing ? `${shown} of ${planned.toFixed(1)} fps` : `${planned.toFixed(2)} fps`;
  document.getElementById("rate").textContent = still ? "" : rate;
  drawMarks(app);
}

function counted(at, pictures) {
  return pictures === 1 ? "1 picture" : `${at + 1} of ${pictures} pictures`;
}

// Over the slider: what is held and can be shown at once, dropped numbers, and pictures that could not be read.
function drawMarks(app) {
  const canvas = document.getElementById("marks");
  const wide = canvas.clientWidth;
  const wanted = `${wide} ${app.faults.size} ${app.source.kept.size} ${app.panes()}`;
  if (canvas.dataset.of === wanted || !wide) return;
  canvas.dataset.of = wanted;
  canvas.width = wide;
  canvas.height = 6;
  const pen = canvas.getContext("2d");
  const { numbers } = app.master;
  const place = (at) => 8 + (wide - 16) * (numbers.length > 1 ? at / (numbers.length - 1) : 0);
  pen.fillStyle = "#6c6c6c";
  numbers.forEach((_, at) => app.loader.holds(at) && pen.fillRect(place(at - 0.5), 4, place(1) - place(0) + 1, 2));
  pen.fillStyle = "#d8d8d8";
  numbers.forEach((value, at) => {
    if (at && !app.index.thinned && value - numbers[at - 1] > 1) pen.fillRect(place(at - 0.5) - 1, 0, 2, 6);
  });
  pen.fillStyle = "#d55e00";
  for (const at of app.faults) pen.fillRect(place(at) - 1.5, 0, 3, 6);
}
