// How the part folds: rigid bodies that turn about the hinges between them, exact at every f.

/** The panels with their arrays read out of the base64 text. */
function readPanels(told) {
  const text = atob(told.data);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  const kinds = { f8: Float64Array, f4: Float32Array, u2: Uint16Array, u4: Uint32Array };
  return told.panels.map((panel) => {
    const out = {};
    for (const [key, value] of Object.entries(panel)) {
      const stored = Array.isArray(value) && typeof value[0] === "string";
      out[key] = stored ? new kinds[value[0]](bytes.buffer, value[1], value[2]) : value;
    }
    out.points = out.body.length;
    out.motions = new Float64Array(12 * (out.angles.length + 1));
    return out;
  });
}

/** Writes the rotation about a unit axis into the first nine numbers of out, row by row. */
function rotation(out, x, y, z, angle) {
  const s = Math.sin(angle);
  const c = 2 * Math.sin(angle / 2) ** 2;
  out[0] = 1 - c * (y * y + z * z);
  out[1] = c * x * y - s * z;
  out[2] = c * x * z + s * y;
  out[3] = c * x * y + s * z;
  out[4] = 1 - c * (x * x + z * z);
  out[5] = c * y * z - s * x;
  out[6] = c * x * z - s * y;
  out[7] = c * y * z + s * x;
  out[8] = 1 - c * (x * x + y * y);
}

const turned = new Float64Array(9);

/** The motion of body `to`, which turns against body `from` about the line (x, y) -> (u, v). */
function hinge(motions, from, to, x, y, u, v, angle) {
  const length = Math.hypot(u - x, v - y);
  rotation(turned, (u - x) / length, (v - y) / length, 0, angle);
  const r = turned;
  const px = x - r[0] * x - r[1] * y;
  const py = y - r[3] * x - r[4] * y;
  const pz = -r[6] * x - r[7] * y;
  for (let row = 0; row < 3; row++) {
    const i = 12 * from + 4 * row;
    const o = 12 * to + 4 * row;
    const a = motions[i];
    const b = motions[i + 1];
    const c = motions[i + 2];
    motions[o] = a * r[0] + b * r[3] + c * r[6];
    motions[o + 1] = a * r[1] + b * r[4] + c * r[7];
    motions[o + 2] = a * r[2] + b * r[5] + c * r[8];
    motions[o + 3] = motions[i + 3] + a * px + b * py + c * pz;
  }
}

/** The motions of all bodies of a panel at f: 0 as built, 1 flat in the plane z = 0. */
function fold(panel, f) {
  const m = panel.motions;
  const turn = panel.turn;
  const angle = Math.hypot(...turn);
  rotation(turned, ...turn.map((x) => (angle ? x / angle : 0)), angle * (1 - f));
  const [px, py] = panel.pivot;
  const goal = [px + panel.shift[0], py + panel.shift[1], 0];
  for (let row = 0; row < 3; row++) {
    const o = 12 * panel.anchor + 4 * row;
    const place = (1 - f) * panel.place[row] + f * goal[row];
    for (let k = 0; k < 3; k++) m[o + k] = turned[3 * row + k];
    m[o + 3] = place - m[o] * px - m[o + 1] * py;
  }
  const h = panel.hinges;
  const bend = (k, from, to, sign) =>
    hinge(m, from, to, h[4 * k], h[4 * k + 1], h[4 * k + 2], h[4 * k + 3], sign * (1 - f) * panel.angles[k]);
  for (let k = panel.anchor; k < panel.angles.length; k++) bend(k, k, k + 1, 1);
  for (let k = panel.anchor - 1; k >= 0; k--) bend(k, k + 1, k, -1);
}

/** Writes where points of the flat strip are after fold(): flat has x, y; body has whose they are. */
function carry(panel, flat, body, out, offset) {
  const m = panel.motions;
  for (let i = 0; i < body.length; i++) {
    const x = flat[2 * i];
    const y = flat[2 * i + 1];
    const k = 12 * body[i];
    const o = offset + 3 * i;
    out[o] = m[k] * x + m[k + 1] * y + m[k + 3];
    out[o + 1] = m[k + 4] * x + m[k + 5] * y + m[k + 7];
    out[o + 2] = m[k + 8] * x + m[k + 9] * y + m[k + 11];
  }
}

/** The part's points (x, y, z in mm, panel after panel) at f, on the middle of the sheet. */
function pointsAt(panels, f) {
  const out = new Float32Array(3 * panels.reduce((sum, panel) => sum + panel.points, 0));
  let offset = 0;
  for (const panel of panels) {
    fold(panel, f);
    carry(panel, panel.flat, panel.body, out, offset);
    offset += 3 * panel.points;
  }
  return out;
}
