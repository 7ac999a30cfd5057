// What is drawn of a panel at one f: skins, walls, rulings and the regression curve, as numbers.

/** A panel with room for everything that is drawn of it, and the indices, which stay the same. */
function shapeOf(panel) {
  const n = panel.points;
  const thick = panel.thickness > 0;
  const walls = thick ? panel.border.length / 2 : 0;
  const count = thick ? 2 * n + 4 * walls : n;
  const shape = {
    panel,
    thick,
    walls,
    position: new Float32Array(3 * count),
    normal: new Float32Array(3 * count),
    bend: new Float32Array(3 * count),
    lines: new Float32Array((thick ? 2 : 1) * 3 * panel.lines.length),
    curve: new Float32Array(3 * panel.curveBody.length),
    creases: new Float32Array(panel.scores ? 6 * (panel.sines.length - panel.parents.length) : 0),
    middle: new Float32Array(3 * n),
    ends: new Float32Array(6 * panel.rulings),
    across: new Float32Array(6 * panel.rulings), // the shading normals before and after each ruling
    offset: new Float32Array(3 * panel.rulings), // where distance 1 from the middle is there
  };
  const index = [];
  const t = panel.triangles;
  for (let i = 0; i < t.length; i += 3) {
    index.push(t[i], t[i + 1], t[i + 2]);
    if (thick) index.push(n + t[i], n + t[i + 2], n + t[i + 1]);
  }
  for (let i = 0; i < walls; i++) {
    const o = 2 * n + 4 * i;
    index.push(o, o + 1, o + 2, o, o + 2, o + 3);
  }
  shape.index = count > 65535 ? new Uint32Array(index) : new Uint16Array(index);
  for (let i = 0; i < n; i++) {
    shape.bend.set([panel.bending[i], panel.height[i], thick ? 1 : 2], 3 * i);
    if (thick) shape.bend.set([panel.bending[i], panel.height[i], -1], 3 * (n + i));
  }
  return shape;
}

/** The bending of a sheet whose rulings do not all bend alike, as it is now. */
function bendAt(shape) {
  const { panel, bend, thick } = shape;
  const n = panel.points;
  for (let i = 0; i < n; i++) {
    const k = panel.cell[i];
    const w = panel.share[i];
    const c = panel.bending[i] * ((1 - w) * panel.bent[k] + w * panel.bent[k + 1]);
    bend[3 * i] = c;
    if (thick) bend[3 * (n + i)] = c;
  }
}

/** The curved creases, piece by piece. */
function creasesAt(shape) {
  const { panel, creases } = shape;
  if (!creases.length) return;
  const r = panel.sines.length / panel.parents.length;
  const body = Uint32Array.from(panel.sines, (_, i) => r + i);
  const points = new Float32Array(3 * body.length);
  carry(panel, panel.scores, body, points, 0);
  let o = 0;
  for (let i = 0; i < body.length; i++) {
    if ((i + 1) % r === 0) continue;
    creases.set(points.subarray(3 * i, 3 * i + 6), o);
    o += 6;
  }
}

/** The normal of a body, the third column of its motion. */
function bodyNormal(panel, body) {
  const k = 12 * body;
  return [panel.motions[k + 2], panel.motions[k + 6], panel.motions[k + 10]];
}

/** Normals and mitres at the rulings: what lies beside a smooth one shares its normal. */
function crossRulings(shape) {
  const { panel, across, offset } = shape;
  const r = panel.rulings;
  for (let k = 0; k < r; k++) {
    const a = bodyNormal(panel, panel.beside[k]);
    const b = bodyNormal(panel, panel.beside[r + k]);
    const cosine = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    const mitre = 1 / Math.max(1 + cosine, 0.1);
    const length = Math.hypot(a[0] + b[0], a[1] + b[1], a[2] + b[2]) || 1;
    for (let j = 0; j < 3; j++) {
      const sum = a[j] + b[j];
      offset[3 * k + j] = sum * mitre;
      across[6 * k + j] = panel.creased[k] ? a[j] : sum / length;
      across[6 * k + 3 + j] = panel.creased[k] ? b[j] : sum / length;
    }
  }
}

/** Fills everything that is drawn for f. */
function shapeAt(shape, f) {
  const { panel, thick, position, normal, middle, across, offset } = shape;
  const n = panel.points;
  const half = panel.thickness / 2;
  fold(panel, f);
  sheetAt(panel, middle, 0);
  endsAt(panel, shape.ends);
  carry(panel, panel.curve, panel.curveBody, shape.curve, 0);
  if (panel.scores) bendAt(shape);
  creasesAt(shape);
  crossRulings(shape);
  for (let i = 0; i < n; i++) {
    const k = panel.cell[i];
    const w = panel.share[i];
    for (let j = 0; j < 3; j++) {
      const nj = (1 - w) * across[6 * k + 3 + j] + w * across[6 * k + 6 + j];
      normal[3 * i + j] = nj;
      if (thick) {
        const away = half * ((1 - w) * offset[3 * k + j] + w * offset[3 * k + 3 + j]);
        position[3 * i + j] = middle[3 * i + j] + away;
        position[3 * (n + i) + j] = middle[3 * i + j] - away;
        normal[3 * (n + i) + j] = -nj;
      } else position[3 * i + j] = middle[3 * i + j];
    }
  }
  wallsAt(shape);
  for (let side = 0; side < (thick ? 2 : 1); side++)
    for (let i = 0; i < panel.lines.length; i++)
      for (let j = 0; j < 3; j++)
        shape.lines[3 * (side * panel.lines.length + i) + j] = position[3 * (side * n + panel.lines[i]) + j];
}

/** The walls between the borders of the two skins, each with its own normal. */
function wallsAt(shape) {
  const { panel, position: p, normal, walls } = shape;
  const n = panel.points;
  for (let i = 0; i < walls; i++) {
    const from = 3 * panel.border[2 * i];
    const to = 3 * panel.border[2 * i + 1];
    const o = 3 * (2 * n + 4 * i);
    for (let j = 0; j < 3; j++) {
      p[o + j] = p[3 * n + from + j];
      p[o + 3 + j] = p[3 * n + to + j];
      p[o + 6 + j] = p[to + j];
      p[o + 9 + j] = p[from + j];
    }
    const ex = p[o + 3] - p[o];
    const ey = p[o + 4] - p[o + 1];
    const ez = p[o + 5] - p[o + 2];
    const ux = p[o + 9] - p[o];
    const uy = p[o + 10] - p[o + 1];
    const uz = p[o + 11] - p[o + 2];
    const x = ey * uz - ez * uy;
    const y = ez * ux - ex * uz;
    const z = ex * uy - ey * ux;
    const length = Math.hypot(x, y, z) || 1;
    for (let k = 0; k < 4; k++) {
      normal[o + 3 * k] = x / length;
      normal[o + 3 * k + 1] = y / length;
      normal[o + 3 * k + 2] = z / length;
    }
  }
}
