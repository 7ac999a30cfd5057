// The page: reads its tables, draws the part, and ties slider, pointer and keys to it.

const byId = (id) => document.getElementById(id);
const told = JSON.parse(byId("part").textContent);
const panels = readPanels(told);
const shapes = panels.map(shapeOf);
const camera = newCamera();
const canvas = byId("canvas");
const overlay = byId("overlay");
const slider = byId("unroll");
const chosen3d = byId("ruling3d");
const chosen2d = byId("ruling");
const drawing = byId("drawing");
const scene = {
  f: 0, mode: 0, range: told.curvature, rulings: true, curve: true, creases: true,
  colours: {
    front: told.colour, back: told.colour.map((x, i) => x * [0.92, 0.82, 0.7][i]),
    low: [0.13, 0.4, 0.74], middle: [0.87, 0.86, 0.83], high: [0.76, 0.2, 0.17],
    ruling: [0, 0, 0, 0.35], curve: [0.85, 0.1, 0.5, 1],
    crease: [0.18, 0.62, 0.31, 1],
  },
};
const state = {
  painter: null, frames: 0, asked: false, moved: true, chosen: null, matrices: null, size: [1, 1],
  coarse: 0, pace: 16, last: 0, rest: 0,
};
const COARSER = [1, 0.7, 0.5, 0.35]; // the share of the screen's pixels that is drawn while sliding

window.devcad = {
  at: (f) => pointsAt(panels, f), // mm, x y z; 0 the part as built, 1 its flat state
  triangles: panels.map((panel) => panel.triangles),
  report: JSON.parse(byId("report").textContent),
  frames: () => state.frames,
  redraw: () => frame(performance.now()),
  painter: () => (state.painter ? state.painter.name : null),
  ready: false,
};

function ask() {
  if (!state.asked) requestAnimationFrame(frame);
  state.asked = true;
}

/** While the part moves, fewer pixels are drawn where the machine is slow; at rest all of them. */
function pace(now) {
  const gap = now - state.last;
  state.last = now;
  if (gap > 250) return;
  state.pace += 0.25 * (gap - state.pace);
  if (state.pace > 26 && state.coarse < COARSER.length - 1) {
    state.coarse += 1;
    state.pace = 16;
  }
  clearTimeout(state.rest);
  state.rest = setTimeout(() => {
    state.coarse = 0;
    ask();
  }, 300);
}

function frame(now) {
  state.asked = false;
  if (!panels.length) return;
  const [width, height] = [canvas.parentElement.clientWidth, canvas.parentElement.clientHeight];
  if (!width || !height) return;
  const fresh = state.moved;
  if (fresh) pace(now);
  const sharp = Math.min(window.devicePixelRatio || 1, 2) * COARSER[state.coarse];
  const pixels = [Math.round(width * sharp), Math.round(height * sharp)];
  if (canvas.width !== pixels[0] || canvas.height !== pixels[1]) [canvas.width, canvas.height] = pixels;
  if (fresh) {
    for (const shape of shapes) shapeAt(shape, scene.f);
    aim(camera, shapes.map((shape) => shape.position));
    state.moved = false;
  }
  state.size = [width, height];
  state.matrices = matrices(camera, scene.f, width / height);
  state.painter.paint(state.matrices, state.size, fresh);
  overlay.setAttribute("viewBox", `0 0 ${width} ${height}`);
  mark();
  state.frames += 1;
}

// --- the slider ---------------------------------------------------------------------------

function unroll(f) {
  scene.f = Math.min(Math.max(f, 0), 1);
  slider.value = String(Math.round(1000 * scene.f));
  const words = scene.f === 0 ? "as built" : scene.f === 1 ? "flat" : `${Math.round(100 * scene.f)} % unrolled`;
  byId("unrolled").textContent = words;
  slider.setAttribute("aria-valuetext", words);
  state.moved = true;
  ask();
}

let playing = 0;
function play() {
  const button = byId("play");
  cancelAnimationFrame(playing);
  if (button.getAttribute("aria-pressed") === "true") return rest();
  button.setAttribute("aria-pressed", "true");
  const [start, goal] = [scene.f, scene.f < 0.5 ? 1 : 0];
  let first = null;
  const step = (now) => {
    first = first === null ? now : first;
    const x = Math.min((now - first) / 2500, 1);
    unroll(start + (goal - start) * x * x * (3 - 2 * x));
    if (x < 1) playing = requestAnimationFrame(step);
    else rest();
  };
  playing = requestAnimationFrame(step);
}

function rest() {
  cancelAnimationFrame(playing);
  byId("play").setAttribute("aria-pressed", "false");
}

// --- a ruling, in both pictures -----------------------------------------------------------

const distance = (x, y, a, b) => {
  const [u, v] = [b[0] - a[0], b[1] - a[1]];
  const s = Math.min(Math.max(((x - a[0]) * u + (y - a[1]) * v) / (u * u + v * v || 1), 0), 1);
  return Math.hypot(x - a[0] - s * u, y - a[1] - s * v);
};

/** The two ends of a ruling on the screen, and its depth. */
function onScreen(shape, k) {
  const r = shape.panel.rulings;
  const [a, b] = [3 * k, 3 * (r + k)].map((i) => project(state.matrices, state.size, ...shape.ends.subarray(i, i + 3)));
  return [a, b, a[2] + b[2]];
}

/** The two ends of a ruling in the drawing. */
function onDrawing(panel, k) {
  const p = panel.pattern;
  const r = panel.rulings;
  return [k, r + k].map((i) => [p[2 * i] + panel.shift[0], -(p[2 * i + 1] + panel.shift[1])]);
}

/** The ruling nearest to a place, within a reach; of equally near ones the one in front. */
function nearest(ends, x, y, reach) {
  let best = null;
  let score = Infinity;
  shapes.forEach((shape, s) => {
    for (let k = 0; k < shape.panel.rulings; k++) {
      const [a, b, depth] = ends(shape, k);
      const d = distance(x, y, a, b);
      const rank = d - (depth === undefined ? 0 : (0.05 * depth) / camera.radius);
      if (d <= reach && rank < score) [best, score] = [[s, k], rank];
    }
  });
  return best;
}

function choose(found) {
  state.chosen = found;
  mark();
  byId("told").textContent = found ? describe(panels[found[0]], found[1]) : byId("told").dataset.idle;
}

function describe(panel, k) {
  const [a, b] = onDrawing(panel, k);
  const radii = [panel.radii[2 * k], panel.radii[2 * k + 1]].map((r) => (r ? Math.abs(r).toFixed(1) : "flat"));
  const each = panel.rulings / panel.flanks;
  const flank = panel.flanks > 1 ? `flank ${Math.floor(k / each) + 1}, ` : "";
  const where = (panels.length > 1 ? `${panel.name}, ` : "") + flank;
  const radius = radii[0] === radii[1] ? radii[0] : radii.join(" to ");
  const bend = radius === "flat" ? "flat there" : `bend radius ${radius} mm`;
  return `${where}ruling ${(k % each) + 1} of ${each}: ${Math.hypot(b[0] - a[0], b[1] - a[1]).toFixed(2)} mm long, ${bend}`;
}

function mark() {
  const found = state.chosen;
  chosen3d.toggleAttribute("hidden", !found);
  chosen2d.toggleAttribute("hidden", !found);
  if (!found || !state.matrices) return;
  const put = (line, [a, b]) => {
    for (const [key, value] of [["x1", a[0]], ["y1", a[1]], ["x2", b[0]], ["y2", b[1]]]) line.setAttribute(key, value);
  };
  put(chosen3d, onScreen(shapes[found[0]], found[1]));
  put(chosen2d, onDrawing(panels[found[0]], found[1]));
}

function step(by) {
  if (!panels.length) return;
  const [s, k] = state.chosen || [0, by > 0 ? -1 : 0];
  const next = k + by;
  if (next >= 0 && next < panels[s].rulings) choose([s, next]);
  else {
    const other = (s + (by > 0 ? 1 : panels.length - 1)) % panels.length;
    choose([other, by > 0 ? 0 : panels[other].rulings - 1]);
  }
}

function pointOnDrawing(event) {
  const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(drawing.getScreenCTM().inverse());
  return [at.x, at.y];
}

drawing.addEventListener("pointermove", (event) => {
  const reach = drawing.viewBox.baseVal.width / 25;
  choose(nearest((shape, k) => onDrawing(shape.panel, k), ...pointOnDrawing(event), reach));
});
drawing.addEventListener("pointerleave", () => choose(null));

// --- orbit, pan, zoom ---------------------------------------------------------------------

const pointers = new Map();
const stage = byId("stage");

function orbit(dx, dy) {
  camera.yaw -= 0.008 * dx;
  camera.pitch = Math.min(Math.max(camera.pitch + 0.008 * dy, -2.35), 1.55);
  ask();
}

function pan(dx, dy) {
  const scale = (2 * Math.min(1, state.size[0] / state.size[1])) / (state.size[1] * camera.zoom);
  camera.panX += scale * dx;
  camera.panY -= scale * dy;
  ask();
}

function zoom(factor) {
  camera.zoom = Math.min(Math.max(camera.zoom * factor, 0.2), 50);
  ask();
}

function home() {
  Object.assign(camera, newCamera());
  state.moved = true;
  ask();
}

stage.addEventListener("pointerdown", (event) => {
  stage.setPointerCapture(event.pointerId);
  pointers.set(event.pointerId, event);
});
for (const name of ["pointerup", "pointercancel"])
  stage.addEventListener(name, (event) => pointers.delete(event.pointerId));
stage.addEventListener("pointermove", (event) => {
  const before = pointers.get(event.pointerId);
  const box = stage.getBoundingClientRect();
  if (!before || event.pointerType === "touch")
    choose(state.matrices && nearest(onScreen, event.clientX - box.left, event.clientY - box.top, 12));
  if (!before) return;
  const [dx, dy] = [event.clientX - before.clientX, event.clientY - before.clientY];
  if (pointers.size === 2) {
    const [other] = [...pointers.values()].filter((each) => each.pointerId !== event.pointerId);
    const gap = (each) => Math.hypot(each.clientX - other.clientX, each.clientY - other.clientY) || 1;
    zoom(gap(event) / gap(before));
    pan(dx / 2, dy / 2);
  } else if (event.shiftKey || event.buttons & 6) pan(dx, dy);
  else orbit(dx, dy);
  pointers.set(event.pointerId, event);
});
stage.addEventListener("pointerleave", () => choose(null));
stage.addEventListener("contextmenu", (event) => event.preventDefault());
stage.addEventListener("wheel", (event) => {
  event.preventDefault();
  zoom(Math.exp(-0.0015 * event.deltaY));
}, { passive: false });
stage.addEventListener("keydown", (event) => {
  const move = event.shiftKey ? pan : orbit;
  const keys = {
    ArrowLeft: () => move(-15, 0), ArrowRight: () => move(15, 0), ArrowUp: () => move(0, -15), ArrowDown: () => move(0, 15),
    "+": () => zoom(1.2), "=": () => zoom(1.2), "-": () => zoom(1 / 1.2), Home: home, "0": home,
    ".": () => step(1), ",": () => step(-1), Escape: () => choose(null),
  };
  if (event.ctrlKey || event.metaKey || event.altKey || !keys[event.key]) return;
  event.preventDefault();
  keys[event.key]();
});

// --- what is shown ------------------------------------------------------------------------

function legend() {
  byId("legend").toggleAttribute("hidden", scene.mode === 0);
  const { low, middle, high } = scene.colours;
  const stops = scene.mode === 1 ? [low, middle, high] : [high, middle, middle];
  const radius = (k) => `${Number((k / scene.range).toPrecision(3)).toLocaleString("en")} mm`;
  const words = scene.mode === 1
    ? [`to the back, r ${radius(1)}`, "flat", `to the front, r ${radius(1)}`]
    : [radius(1), "", `${radius(32)} and more`];
  stops.forEach((rgb, i) => {
    byId(`stop${i}`).setAttribute("stop-color", `rgb(${rgb.map((x) => Math.round(255 * x))})`);
    byId(`word${i}`).textContent = words[i];
  });
  if (scene.mode === 2) byId("stop1").setAttribute("offset", "1");
  else byId("stop1").setAttribute("offset", "0.5");
}

slider.addEventListener("input", () => {
  rest();
  unroll(slider.value / 1000);
});
byId("play").addEventListener("click", play);
byId("home").addEventListener("click", home);
byId("print").addEventListener("click", () => window.print());
byId("colour").addEventListener("change", (event) => {
  scene.mode = Number(event.target.value);
  legend();
  ask();
});
for (const key of ["rulings", "curve", "creases"])
  byId(`show-${key}`).addEventListener("change", (event) => {
    scene[key] = event.target.checked;
    ask();
  });
for (const box of document.querySelectorAll("[data-toggles]"))
  box.addEventListener("change", () => {
    for (const group of drawing.querySelectorAll("[data-layer]"))
      if (group.dataset.layer === box.dataset.toggles) group.toggleAttribute("hidden", !box.checked);
  });

function begin() {
  if (!panels.length) return;
  if (scene.range === 0) byId("colour").disabled = true;
  let paint = null;
  try {
    paint = webglPainter(canvas, shapes, scene);
  } catch (problem) {
    paint = null;
  }
  const name = paint ? "webgl" : "svg";
  canvas.toggleAttribute("hidden", !paint);
  byId("painted").toggleAttribute("hidden", Boolean(paint));
  state.painter = { name, paint: paint || svgPainter(byId("painted"), shapes, scene) };
  canvas.addEventListener("webglcontextlost", () => {
    byId("painted").toggleAttribute("hidden", false);
    canvas.toggleAttribute("hidden", true);
    state.painter = { name: "svg", paint: svgPainter(byId("painted"), shapes, scene) };
    ask();
  });
  document.documentElement.classList.add("alive");
  new ResizeObserver(ask).observe(stage);
  unroll(0);
  frame(performance.now());
  window.devcad.ready = true;
}

begin();
