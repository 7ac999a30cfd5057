// How the part folds: rigid bodies, exact at every f. Those of a strip turn about the hinges between
// them; of a sheet with curved creases every ruling is one.

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
    out.motions = new Float64Array(12 * out.bodies);
    out.bent = new Float64Array(out.rulings); // of each ruling by what its curvature is multiplied
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

/** The motion of a panel's anchor at f: it turns evenly, and its pivot goes straight. */
function anchored(panel, f) {
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
}

/** The motions of all bodies of a panel at f: 0 as built, 1 flat in the plane z = 0. */
function fold(panel, f) {
  const m = panel.motions;
  if (panel.still) {
    m.set(panel.still);
    panel.bent.fill(1);
    return;
  }
  anchored(panel, f);
  if (panel.scores) {
    foldScored(panel, f);
    return;
  }
  panel.bent.fill(1 - f);
  const h = panel.hinges;
  const bend = (k, from, to, sign) =>
    hinge(m, from, to, h[4 * k], h[4 * k + 1], h[4 * k + 2], h[4 * k + 3], sign * (1 - f) * panel.angles[k]);
  for (let k = panel.anchor; k < panel.angles.length; k++) bend(k, k, k + 1, 1);
  for (let k = panel.anchor - 1; k >= 0; k--) bend(k, k + 1, k, -1);
}

/** What the values at the poses of a panel count at f, so that their sum is the polynomial there. */
function weightsAt(poses, f) {
  const at = poses.indexOf(f);
  if (at >= 0) return Array.from(poses, (_, i) => (i === at ? 1 : 0));
  const each = Array.from(poses, (pose, i) => ((i % 2 ? -1 : 1) * (i && i < poses.length - 1 ? 1 : 0.5)) / (f - pose));
  const sum = each.reduce((a, b) => a + b, 0);
  return each.map((x) => x / sum);
}

const small = new Float64Array(12);
const product = new Float64Array(12);

/** The motion of body `to`: that of `from` after the small one, or after what undoes the small one. */
function compose(m, from, to, back) {
  const s = small;
  if (back) {
    const [a, b, c, x, d, e, g, y, h, i, j, z] = s;
    s.set([a, d, h, -(a * x + d * y + h * z), b, e, i, -(b * x + e * y + i * z), c, g, j, -(c * x + g * y + j * z)]);
  }
  for (let row = 0; row < 3; row++)
    for (let k = 0; k < 4; k++) {
      const i = 12 * from + 4 * row;
      product[4 * row + k] = m[i] * s[k] + m[i + 1] * s[4 + k] + m[i + 2] * s[8 + k] + (k === 3 ? m[i + 3] : 0);
    }
  m.set(product, 12 * to);
}

/** The small motion that turns by a vector about a point of the pattern, which then moves by (u, v, w). */
function turnAbout(tx, ty, tz, x, y, u, v, w) {
  const angle = Math.hypot(tx, ty, tz);
  const one = angle || 1;
  rotation(turned, tx / one, ty / one, tz / one, angle);
  const r = turned;
  for (let row = 0; row < 3; row++) for (let k = 0; k < 3; k++) small[4 * row + k] = r[3 * row + k];
  small[3] = x + u - r[0] * x - r[1] * y;
  small[7] = y + v - r[3] * x - r[4] * y;
  small[11] = w - r[6] * x - r[7] * y;
}

/** The motions of a sheet with curved creases, the anchor's known: of the first flank one after the
 * other, of every other flank about the crease that it shares with its parent. */
function foldScored(panel, f) {
  const { motions: m, anchor, steps, scores, along, sines, parents } = panel;
  const share = weightsAt(panel.poses, f);
  const flanks = parents.length + 1;
  const r = panel.rulings / flanks;
  const step = (k, from, to, back) => {
    const s = [0, 0, 0, 0, 0, 0];
    for (let p = 0; p < share.length; p++)
      for (let j = 0; j < 6; j++) s[j] += share[p] * steps[6 * ((r - 1) * p + k) + j];
    turnAbout(s[0], s[1], s[2], scores[2 * k + 2], scores[2 * k + 3], s[3], s[4], s[5]);
    compose(m, from, to, back);
  };
  for (let k = anchor; k < r - 1; k++) step(k, k, k + 1, false);
  for (let k = anchor - 1; k >= 0; k--) step(k, k + 1, k, true);
  parents.forEach((parent, j) => {
    let mu = 0;
    for (let p = 0; p < share.length; p++) mu += share[p] * panel.mus[share.length * j + p];
    for (let k = 0; k < r; k++) {
      const i = r * j + k;
      const sine = Math.min(Math.max(mu * sines[i], -1), 1);
      const angle = 2 * Math.asin(sine);
      turnAbout(angle * along[2 * i], angle * along[2 * i + 1], 0, scores[2 * i], scores[2 * i + 1], 0, 0, 0);
      compose(m, r * parent + k, r * (j + 1) + k, false);
      // both sides of a crease bend as the tangent of half its angle
      const bent = mu * Math.sqrt((1 - sines[i] ** 2) / Math.max(1 - sine ** 2, 1e-30));
      panel.bent[r * (j + 1) + k] = bent;
      if (j === 0) panel.bent[k] = bent;
    }
  });
}

/** Writes where the points of a panel's sheet are after fold(), and of a sheet whose points lie
 * between rulings where these end. */
function sheetAt(panel, out, offset) {
  if (!panel.corners) {
    carry(panel, panel.flat, panel.body, out, offset);
    return;
  }
  const ends = endsAt(panel, new Float32Array(6 * panel.rulings));
  for (let i = 0; i < panel.points; i++)
    for (let j = 0; j < 3; j++) {
      let x = 0;
      for (let k = 3 * i; k < 3 * i + 3; k++) x += panel.weights[k] * ends[3 * panel.corners[k] + j];
      out[offset + 3 * i + j] = x;
    }
}

/** Writes where the ends of the rulings are after fold(). */
function endsAt(panel, out) {
  const r = panel.rulings;
  for (let side = 0; side < 2; side++)
    carry(panel, panel.ends.subarray(2 * r * side, 2 * r * (side + 1)), panel.beside.subarray(0, r), out, 3 * r * side);
  return out;
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
    sheetAt(panel, out, offset);
    offset += 3 * panel.points;
  }
  return out;
}
