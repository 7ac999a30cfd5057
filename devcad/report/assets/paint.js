// Two ways to draw the same shapes: WebGL, and SVG where there is none.

/** A painter with WebGL; null where the browser has none. */
function webglPainter(canvas, shapes, scene) {
  const gl = canvas.getContext("webgl", { antialias: true, alpha: true });
  if (!gl || !gl.getExtension("OES_element_index_uint")) return null;
  const program = (name) => {
    const made = gl.createProgram();
    for (const [kind, end] of [[gl.VERTEX_SHADER, "vert"], [gl.FRAGMENT_SHADER, "frag"]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, document.getElementById(`${name}.${end}`).textContent);
      gl.compileShader(shader);
      gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
    return made;
  };
  const surface = program("surface");
  const line = program("line");
  const places = new Map(); // asking for a place anew every time would wait for the other process
  const place = (of, kind, name) => {
    const key = `${of === surface} ${name}`;
    if (!places.has(key)) places.set(key, gl[`get${kind}Location`](of, name));
    return places.get(key);
  };
  const set = (of, kind, name, ...values) => gl[`uniform${kind}`](place(of, "Uniform", name), ...values);
  const held = new Map();
  const hold = (target, data, fresh) => {
    const known = held.get(data);
    if (!known) held.set(data, gl.createBuffer());
    gl.bindBuffer(target, held.get(data));
    if (!known) gl.bufferData(target, data, gl.DYNAMIC_DRAW);
    else if (fresh) gl.bufferSubData(target, 0, data);
  };
  const feed = (of, name, data, fresh) => {
    const at = place(of, "Attrib", name);
    hold(gl.ARRAY_BUFFER, data, fresh);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, 3, gl.FLOAT, false, 0, 0);
  };
  gl.enable(gl.DEPTH_TEST);
  gl.enable(gl.BLEND);
  gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);

  function drawLines(data, mode, fresh) {
    feed(line, "position", data, fresh);
    gl.drawArrays(mode, 0, data.length / 3);
  }

  return function paint(m, size, fresh) {
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.useProgram(surface);
    for (const of of [surface, line]) {
      gl.useProgram(of);
      set(of, "Matrix4fv", "camera", false, m.camera);
      set(of, "Matrix4fv", "view", false, m.view);
    }
    gl.useProgram(surface);
    for (const name of ["front", "back", "low", "middle", "high"]) set(surface, "3fv", name, scene.colours[name]);
    set(surface, "1i", "mode", scene.mode);
    set(surface, "1f", "range", scene.range);
    for (const shape of shapes) {
      const { panel } = shape;
      set(surface, "1f", "bent", panel.scores ? 1 : 1 - scene.f);
      feed(surface, "position", shape.position, fresh);
      feed(surface, "normal", shape.normal, fresh);
      feed(surface, "bend", shape.bend, fresh && Boolean(panel.scores));
      hold(gl.ELEMENT_ARRAY_BUFFER, shape.index, false);
      const kind = shape.index instanceof Uint32Array ? gl.UNSIGNED_INT : gl.UNSIGNED_SHORT;
      gl.drawElements(gl.TRIANGLES, shape.index.length, kind, 0);
    }
    gl.useProgram(line);
    for (const shape of shapes) {
      set(line, "4fv", "colour", scene.colours.ruling);
      if (scene.rulings) drawLines(shape.lines, gl.LINES, fresh);
      set(line, "4fv", "colour", scene.colours.curve);
      if (scene.curve && shape.curve.length) {
        drawLines(shape.curve, gl.LINES, fresh);
        drawLines(shape.curve, gl.POINTS, false);
      }
      set(line, "4fv", "colour", scene.colours.crease);
      if (scene.creases && shape.creases.length) drawLines(shape.creases, gl.LINES, fresh);
    }
  };
}

/** A painter into an SVG element: the farther triangles first, lit as in the shader. */
function svgPainter(svg, shapes, scene) {
  const make = (name) => svg.appendChild(document.createElementNS(svg.namespaceURI, name));
  const faces = shapes.map((shape) => Array.from({ length: shape.panel.triangles.length / 3 }, () => make("path")));
  const lines = { curve: make("path"), creases: make("path") };
  for (const name of ["curve", "creases"]) lines[name].setAttribute("class", name);
  const mix = (a, b, x) => a.map((v, i) => v + (b[i] - v) * x);
  const clamp = (x, a, b) => Math.min(Math.max(x, a), b);

  function colour(shape, corners, facing) {
    const { panel } = shape;
    const bent = (i) => (1 - panel.share[i]) * panel.bent[panel.cell[i]] + panel.share[i] * panel.bent[panel.cell[i] + 1];
    const c = corners.reduce((sum, i) => sum + panel.bending[i] * bent(i), 0);
    const most = Math.max(Math.abs(corners.reduce((sum, i) => sum + panel.height[i], 0)) * scene.range, 1e-30);
    const { low, middle, high, front, back } = scene.colours;
    const x = clamp(c / most, -1, 1);
    if (scene.mode === 1) return x < 0 ? mix(middle, low, -x) : mix(middle, high, x);
    if (scene.mode === 2) return mix(high, middle, clamp(-Math.log2(Math.max(Math.abs(x), 1 / 32)) / 5, 0, 1));
    return facing > 0 ? front : back;
  }

  return function paint(m, size) {
    svg.setAttribute("viewBox", `0 0 ${size[0]} ${size[1]}`);
    const seen = [];
    shapes.forEach((shape, s) => {
      const t = shape.panel.triangles;
      const at = (i) => project(m, size, ...shape.middle.subarray(3 * i, 3 * i + 3));
      for (let i = 0; i < t.length; i += 3) {
        const corners = [t[i], t[i + 1], t[i + 2]];
        const [a, b, c] = corners.map(at);
        const facing = (b[1] - a[1]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[1] - a[1]);
        const k = 3 * corners[0];
        const n = [0, 1, 2].map((j) => m.view[j] * shape.normal[k] + m.view[4 + j] * shape.normal[k + 1] + m.view[8 + j] * shape.normal[k + 2]);
        const sun = (Math.sign(facing) * (-0.45 * n[0] + 0.55 * n[1] + 0.7 * n[2])) / 0.998;
        const light = 0.58 + 0.42 * Math.max(sun, 0);
        const rgb = colour(shape, corners, facing).map((x) => Math.round(255 * clamp(x * light, 0, 1)));
        const d = `M${[a, b, c].map((p) => `${p[0].toFixed(1)} ${p[1].toFixed(1)}`).join("L")}Z`;
        seen.push([a[2] + b[2] + c[2], faces[s][i / 3], d, `rgb(${rgb})`]);
      }
    });
    seen.sort((a, b) => a[0] - b[0]);
    for (const [, path, d, fill] of seen) {
      path.setAttribute("d", d);
      path.setAttribute("fill", fill);
      path.setAttribute("stroke", scene.rulings ? "none" : fill);
      svg.appendChild(path);
    }
    for (const [name, path] of Object.entries(lines)) {
      svg.appendChild(path);
      path.setAttribute("d", scene[name] ? shapes.map((shape) => {
        const text = [];
        for (let i = 0; i < shape[name].length; i += 3)
          text.push(`${i % 2 ? "L" : "M"}${project(m, size, ...shape[name].subarray(i, i + 3)).slice(0, 2).map((x) => x.toFixed(1)).join(" ")}`);
        return text.join("");
      }).join("") : "");
    }
  };
}
