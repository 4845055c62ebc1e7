// Mouse, pen and fingers on the pictures: lights are dragged, pictures moved and zoomed, pixels read.
import { directionAt } from "./lights.js";
import { isRelit, windowOf } from "./looks.js";
import { discOf } from "./panes.js";

const MOST_ZOOM = 32;

export function listenToPointers(app) {
  const { viewer } = app;
  const fingers = new Map();
  let held = null;
  viewer.addEventListener("pointerdown", (event) => {
    if (event.target.closest("select, .message, #wipe")) return;
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    if (fingers.size > 1) {
      held = { kind: "pinch" };
      return;
    }
    held = begun(app, event);
    viewer.setPointerCapture(event.pointerId);
    if (held?.kind === "light") {
      moveLight(app, held, event);
      viewer.querySelector(`.pane[data-place="${held.place}"] .knob.chosen`)?.focus({ preventScroll: true });
    }
    event.preventDefault();
  });
  viewer.addEventListener("pointermove", (event) => {
    app.pointAt(paneAt(app, event), event);
    const before = fingers.get(event.pointerId);
    if (!before || !held) return;
    if (held.kind === "pinch") pinch(app, fingers, event);
    else if (held.kind === "light") moveLight(app, held, event);
    else if (held.kind === "pan") pan(app, held.element, event.clientX - before[0], event.clientY - before[1]);
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
  });
  const let_go = (event) => {
    fingers.delete(event.pointerId);
    if (fingers.size === 0) held = null;
  };
  viewer.addEventListener("pointerup", let_go);
  viewer.addEventListener("pointercancel", let_go);
  viewer.addEventListener("pointerleave", () => app.pointAt(null));
  viewer.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoomAt(app, paneAt(app, event), event, 2 ** (-event.deltaY / 300));
  }, { passive: false });
  viewer.addEventListener("dblclick", (event) => {
    if (!event.target.closest("select, .knob")) app.change({ zoom: 1, centre: [0.5, 0.5] });
  });
  listenToWipe(app);
}

// The pane under a pointer; in a wipe the two lie on each other, and the line separates them.
function paneAt(app, event) {
  if (app.state.layout === "wipe") {
    const box = app.viewer.getBoundingClientRect();
    return app.paneElements[event.clientX - box.left < app.state.wipe * box.width ? 0 : 1];
  }
  return app.paneElements.find((element) => {
    const box = element.getBoundingClientRect();
    return event.clientX >= box.left && event.clientX < box.right && event.clientY >= box.top && event.clientY < box.bottom;
  });
}

function begun(app, event) {
  const element = paneAt(app, event);
  if (!element) return null;
  const place = Number(element.dataset.place);
  const knob = event.target.closest(".knob");
  const relit = isRelit(element.dataset.content) && app.state.lights.length > 0;
  if (place !== app.state.active) app.change({ active: place });
  if (knob) app.change({ selected: Number(knob.dataset.light) });
  const moves = event.shiftKey || event.button === 1 || event.button === 2 || !relit;
  return { kind: moves ? "pan" : "light", element, place };
}

function moveLight(app, held, event) {
  const box = held.element.getBoundingClientRect();
  const { middle, radius } = discOf(app, held.element);
  const x = (event.clientX - box.left - middle[0]) / radius;
  const y = -(event.clientY - box.top - middle[1]) / radius;
  app.state.dragged = true;
  app.changeLight(app.state.selected, { direction: directionAt(x, y) });
}

function pan(app, element, right, down) {
  const box = element.getBoundingClientRect();
  const part = windowOf(app, box.width, box.height);
  const [u, v] = app.state.centre;
  app.change({ centre: [within(u - right / box.width * part.width), within(v - down / box.height * part.height)] });
}

function within(share) {
  return Math.min(Math.max(share, 0), 1);
}

// Zoom by a factor so that what lies under the pointer stays there.
function zoomAt(app, element, { clientX, clientY }, factor) {
  if (!element) return;
  const zoom = Math.min(Math.max(app.state.zoom * factor, 1), MOST_ZOOM);
  const box = element.getBoundingClientRect();
  const part = windowOf(app, box.width, box.height);
  const [across, down] = [(clientX - box.left) / box.width, (clientY - box.top) / box.height];
  const shrink = app.state.zoom / zoom;
  const at = [part.x + across * part.width, part.y + down * part.height];
  const centre = [at[0] + (0.5 - across) * part.width * shrink, at[1] + (0.5 - down) * part.height * shrink];
  app.change({ zoom, centre: zoom === 1 ? [0.5, 0.5] : centre.map(within) });
}

function pinch(app, fingers, event) {
  const others = [...fingers].filter(([id]) => id !== event.pointerId).map(([, place]) => place);
  if (!others.length) return;
  const [other] = others;
  const before = fingers.get(event.pointerId);
  const spread = (place) => Math.hypot(place[0] - other[0], place[1] - other[1]);
  const now = [event.clientX, event.clientY];
  const middle = { clientX: (now[0] + other[0]) / 2, clientY: (now[1] + other[1]) / 2 };
  const element = paneAt(app, middle);
  if (element && spread(before) > 1) zoomAt(app, element, middle, spread(now) / spread(before));
  if (element) pan(app, element, (now[0] - before[0]) / 2, (now[1] - before[1]) / 2);
}

function listenToWipe(app) {
  const line = document.getElementById("wipe");
  line.addEventListener("pointerdown", (event) => line.setPointerCapture(event.pointerId));
  line.addEventListener("pointermove", (event) => {
    if (!line.hasPointerCapture(event.pointerId)) return;
    const box = app.viewer.getBoundingClientRect();
    app.change({ wipe: within((event.clientX - box.left) / box.width) });
  });
  line.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: -0.02, ArrowRight: 0.02 }[event.key];
    if (!step) return;
    event.stopPropagation();
    event.preventDefault();
    app.change({ wipe: within(app.state.wipe + step) });
  });
}
