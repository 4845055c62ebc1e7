// Keys, and the page that explains them.
import { directionAt } from "./lights.js";

const HELP = [
  ["Sequence", [["Space", "play and stop"], ["← →", "one picture back or on; with Shift ten"], ["Home  End", "first and last"], ["Enter", "in the number field: go to that picture"]]],
  ["Pictures", [["1 … 9", "what the active pane shows, in the list's order"], ["N", "make the next pane active"], ["S  D  F  W", "one, two or four panes, or a wipe; two stand as they are larger"], ["X", "swap A and B"], ["B", "before and after: Algorithm 1 of Hudon et al. 2015 against this split"], ["Wheel", "or two fingers: zoom; Shift and drag moves; 0 or a double click fits"]]],
  ["Light", [["Drag", "in the relit picture: moves the chosen light"], ["Tab ← → ↑ ↓", "the same by keys, on the light's handle"], ["L  Delete", "add a light; remove the chosen one"]]],
  ["Looking", [["[  ]", "a quarter stop darker, brighter"], ["A", "expose for this picture"], ["C", "next channel"], ["V", "hatch what is not valid"], ["T  P", "timing; panel"], ["?", "this page"]]],
];

export function buildHelp() {
  const help = document.getElementById("help");
  const close = Object.assign(document.createElement("button"), { type: "button", textContent: "Close", className: "close" });
  close.addEventListener("click", () => help.close());
  const title = Object.assign(document.createElement("h2"), { textContent: "Keys and gestures" });
  const groups = document.createElement("div");
  groups.className = "groups";
  for (const [name, rows] of HELP) {
    const group = document.createElement("section");
    group.append(Object.assign(document.createElement("h3"), { textContent: name }));
    const list = document.createElement("dl");
    for (const [keys, words] of rows) {
      list.append(keyNames(keys), Object.assign(document.createElement("dd"), { textContent: words }));
    }
    group.append(list);
    groups.append(group);
  }
  help.replaceChildren(title, close, groups);
  help.addEventListener("click", (event) => event.target === help && help.close());
}

function keyNames(keys) {
  const term = document.createElement("dt");
  term.append(...keys.split(" ").filter(Boolean).map((name) => Object.assign(document.createElement("kbd"), { textContent: name })));
  return term;
}

export function listenToKeys(app) {
  // what was clicked lets go of the focus, so that Space plays; what Tab reached keeps it and is pressed
  document.addEventListener("click", (event) => {
    if (event.detail > 0) event.target.closest("button:not(.knob), summary, input[type=checkbox], label.tick")?.blur();
  });
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || document.getElementById("help").open) return;
    const on = event.target;
    if (on.matches("input[type=text], select, input[type=color]")) return;
    if (on.matches(".knob") && nudge(app, event)) return;
    if (on.matches("input[type=range]") && event.key.startsWith("Arrow")) return;
    if (on.matches("button, summary, input[type=checkbox], a") && (event.key === " " || event.key === "Enter")) return;
    const act = actions(app, event)[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!act) return;
    event.preventDefault();
    act();
  });
}

function actions(app, event) {
  const { state } = app;
  const far = event.shiftKey ? 10 : 1;
  const known = {
    " ": () => app.play(!state.playing),
    ArrowLeft: () => app.go(state.at - far),
    ArrowRight: () => app.go(state.at + far),
    Home: () => app.go(0),
    End: () => app.go(Infinity),
    n: () => app.change({ active: (state.active + 1) % app.paneElements.length }),
    s: () => app.layOut("one"),
    d: () => app.layOut("two"),
    f: () => app.layOut("four"),
    w: () => app.layOut("wipe"),
    x: () => app.swap(),
    b: () => app.beforeAndAfter(),
    l: () => app.addLight(),
    Delete: () => app.removeLight(state.selected),
    Backspace: () => app.removeLight(state.selected),
    "[": () => app.change({ exposure: state.exposure - 0.25 }),
    "]": () => app.change({ exposure: state.exposure + 0.25 }),
    a: () => app.expose(),
    c: () => app.change({ channels: (state.channels + 1) % 5 }),
    v: () => app.mark(!app.marks()),
    t: () => app.toggleTiming(),
    p: () => app.togglePanel(),
    0: () => app.change({ zoom: 1, centre: [0.5, 0.5] }),
    "?": () => document.getElementById("help").showModal(),
  };
  for (let digit = 1; digit <= 9; digit += 1) {
    const content = app.contents[digit - 1];
    if (content) known[digit] = () => app.showIn(state.active, content.id);
  }
  return known;
}

// Move the light of a focused handle; true where the key was one for it.
function nudge(app, event) {
  const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
  if (!step) return false;
  event.preventDefault();
  const far = event.shiftKey ? 0.2 : 0.04;
  const [x, y] = app.state.lights[app.state.selected].direction;
  app.changeLight(app.state.selected, { direction: directionAt(x + step[0] * far, y + step[1] * far) });
  return true;
}

