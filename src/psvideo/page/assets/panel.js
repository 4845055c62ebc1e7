// The panel at the side: lights, surface, display, the pixel under the pointer, and what is known of the take.
import { MOST_LIGHTS } from "./lights.js";
import { AROUND } from "./around.js";
import { RELIT } from "./looks.js";
import { ofPhotographs } from "./transport.js";

export function buildPanel(app) {
  const parts = [];
  if (app.contents.some(({ id }) => id === RELIT)) parts.push(lightsPart(app), aroundPart(app), surfacePart(app));
  parts.push(displayPart(app), part("Pixel", "pixel", element("dl", { id: "pixel", className: "facts", textContent: "Move over a picture." })), takePart(app));
  document.getElementById("panel").replaceChildren(...parts);
}

function part(title, name, ...inside) {
  const box = element("details", { open: true, id: `part-${name}` });
  box.append(element("summary", { textContent: title }), ...inside);
  return box;
}

function element(kind, properties = {}, ...inside) {
  const made = Object.assign(document.createElement(kind), properties);
  made.append(...inside);
  return made;
}

function slider(label, { id, min, max, step, value, show, change }) {
  const output = element("output", { textContent: show(value) });
  const input = element("input", { type: "range", id, min, max, step, value });
  input.addEventListener("input", () => {
    output.textContent = show(Number(input.value));
    change(Number(input.value));
  });
  return element("label", { className: "slider" }, element("span", { textContent: label }), input, output);
}

const plain = (digits) => (value) => value.toFixed(digits);

function lightsPart(app) {
  const list = element("div", { id: "lights" });
  const add = element("button", { type: "button", id: "add-light", textContent: "Add a light", title: "Add a light (L)" });
  add.addEventListener("click", () => app.addLight());
  return part("Lights", "lights", list, add);
}

// Draw the list of lights again; called when lights are added, removed or chosen.
export function tellLights(app) {
  const list = document.getElementById("lights");
  if (!list) return;
  const wanted = app.state.lights.map((light) => `${light.place}${light.near}`).join() + app.state.selected;
  if (list.dataset.of === wanted) return;
  list.dataset.of = wanted;
  const held = document.activeElement?.id;
  list.replaceChildren(...app.state.lights.map((light, place) => lightRow(app, light, place)));
  if (held) document.getElementById(held)?.focus();
  document.getElementById("add-light").disabled = app.state.lights.length >= MOST_LIGHTS;
}

function lightRow(app, light, place) {
  const set = (patch) => app.changeLight(place, patch);
  const chosen = place === app.state.selected;
  const row = element("fieldset", { className: chosen ? "light chosen" : "light" });
  const name = element("button", { type: "button", className: "name", id: `light-${place}`, textContent: light.name });
  name.setAttribute("aria-pressed", String(chosen));
  name.addEventListener("click", () => app.change({ selected: place }));
  const colour = element("input", { type: "color", value: light.colour, title: "Colour", id: `colour-${place}` });
  colour.setAttribute("aria-label", `Colour of ${light.name}`);
  colour.addEventListener("input", () => set({ colour: colour.value }));
  const gone = element("button", { type: "button", className: "small", textContent: "✕", title: "Remove (Delete)", id: `remove-${place}` });
  gone.setAttribute("aria-label", `Remove ${light.name}`);
  gone.addEventListener("click", () => app.removeLight(place));
  row.append(element("div", { className: "row" }, name, colour, gone));
  if (chosen) row.append(...lightControls(light, place, set));
  return row;
}

function lightControls(light, place, set) {
  const near = element("input", { type: "checkbox", checked: light.near, id: `near-${place}` });
  near.addEventListener("change", () => set({ near: near.checked }));
  const controls = [
    slider("Strength", { id: `intensity-${place}`, min: 0, max: 4, step: 0.01, value: light.intensity, show: plain(2), change: (intensity) => set({ intensity }) }),
    element("label", { className: "tick" }, near, element("span", { textContent: "Near" })),
  ];
  if (light.near) {
    const show = (value) => `${value.toFixed(2)} widths`;
    controls.push(slider("Distance", { id: `distance-${place}`, min: 0.1, max: 4, step: 0.01, value: light.distance, show, change: (distance) => set({ distance }) }));
  }
  return controls;
}

function aroundPart(app) {
  const { around, aroundTurn, aroundStrength } = app.state;
  const choice = element("select", { id: "around" }, new Option("None", "none"), ...Object.entries(AROUND).map(([name, { label }]) => new Option(label, name)));
  choice.value = around;
  choice.addEventListener("change", () => app.change({ around: choice.value }));
  return part("Light from all around", "around",
    element("label", { className: "slider" }, element("span", { textContent: "Place" }), choice),
    slider("Turn", { id: "around-turn", min: -180, max: 180, step: 1, value: aroundTurn, show: (value) => `${value}°`, change: (value) => app.change({ aroundTurn: value }) }),
    slider("Strength", { id: "around-strength", min: 0, max: 3, step: 0.01, value: aroundStrength, show: plain(2), change: (value) => app.change({ aroundStrength: value }) }),
  );
}

function surfacePart(app) {
  const { specular, exponent, relief } = app.state;
  const inside = [
    slider("Highlight", { id: "specular", min: 0, max: 1, step: 0.01, value: specular, show: plain(2), change: (value) => app.change({ specular: value }) }),
    slider("Sharpness", { id: "exponent", min: 2, max: 200, step: 1, value: exponent, show: plain(0), change: (value) => app.change({ exponent: value }) }),
  ];
  if (app.sequences.has("depth") && !app.sequences.has("position")) {
    inside.push(slider("Relief", { id: "relief", min: 0, max: 4, step: 0.05, value: relief, show: plain(2), change: (value) => app.change({ relief: value }) }));
  }
  return part("Surface", "surface", ...inside);
}

function displayPart(app) {
  const show = (value) => `${value >= 0 ? "+" : "−"}${Math.abs(value).toFixed(2)} EV`;
  const exposure = slider("Exposure", { id: "exposure", min: -6, max: 6, step: 0.05, value: app.state.exposure, show, change: (value) => app.change({ exposure: value }) });
  const channels = element("select", { id: "channels" }, ...["All", "Red, x", "Green, y", "Blue, z", "Luminance"].map((label, value) => new Option(label, value)));
  channels.addEventListener("change", () => app.change({ channels: Number(channels.value) }));
  const marked = element("input", { type: "checkbox", id: "mark-invalid", checked: app.state.markInvalid });
  marked.addEventListener("change", () => app.mark(marked.checked));
  const inside = [exposure, element("label", { className: "slider" }, element("span", { textContent: "Channels" }), channels)];
  if (app.sequences.has("valid")) {
    inside.push(element("label", { className: "tick" }, marked, element("span", { textContent: "Hatch what is not valid" })));
  }
  const auto = element("button", { type: "button", id: "auto", textContent: "Expose for this picture", title: "Expose for this picture (A)" });
  auto.addEventListener("click", () => app.expose());
  const fit = element("button", { type: "button", id: "fit", textContent: "Fit", title: "Fit the picture into its pane (0)" });
  fit.addEventListener("click", () => app.change({ zoom: 1, centre: [0.5, 0.5] }));
  inside.push(element("div", { className: "row" }, auto, fit));
  return part("Display", "display", ...inside);
}

// Bring the controls in line with what keys have changed.
export function tellControls(app) {
  const { exposure, channels } = app.state;
  setValue("exposure", exposure);
  setValue("channels", channels);
  const marked = document.getElementById("mark-invalid");
  if (marked) marked.checked = app.marks();
}

function setValue(id, value) {
  const control = document.getElementById(id);
  if (!control || Number(control.value) === value) return;
  control.value = value;
  const output = control.parentElement.querySelector("output");
  if (output) output.textContent = `${value >= 0 ? "+" : "−"}${Math.abs(value).toFixed(2)} EV`;
}

function takePart(app) {
  const { index } = app;
  const list = element("dl", { className: "facts" });
  const lens = [...new Set(index.sequences.filter((one) => one.kind === "normals").map((one) => `${one.space} space, y ${one.y}`))];
  const facts = { Kind: index.kind, Size: `${index.width_px} × ${index.height_px}`, ...(ofPhotographs(index) ? {} : { Rate: `${index.fps.toFixed(3)} a second` }), ...(lens.length ? { Normals: lens.join("; ") } : {}), ...index.facts };
  for (const [name, value] of Object.entries(facts)) list.append(element("dt", { textContent: name }), element("dd", { textContent: value }));
  const sentences = [...index.findings, ...index.notes].map((text) => element("li", { textContent: text }));
  const findings = element("ul", { className: "findings" }, ...sentences);
  return part("This take", "take", ...(index.verdict ? [element("p", { textContent: index.verdict })] : []), findings, list);
}

