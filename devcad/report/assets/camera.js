// The camera: it looks at the middle of what there is, from the side and a little from above.

const FIELD = 0.6; // radians, the camera's field of view

/** A camera that turns about its target; pan is in shares of the radius, zoom a factor. */
function newCamera() {
  return { yaw: -1.13, pitch: 0.42, zoom: 1, panX: 0, panY: 0, middle: [0, 0, 0], radius: 1 };
}

/** Looks at points (x, y, z after one another): at the middle of their box, and all are in view. */
function aim(camera, arrays) {
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  for (const points of arrays)
    for (let i = 0; i < points.length; i++) {
      const j = i % 3;
      if (points[i] < low[j]) low[j] = points[i];
      if (points[i] > high[j]) high[j] = points[i];
    }
  camera.middle = low.map((x, j) => (x + high[j]) / 2);
  let most = 0;
  const [x, y, z] = camera.middle;
  for (const points of arrays)
    for (let i = 0; i < points.length; i += 3)
      most = Math.max(most, (points[i] - x) ** 2 + (points[i + 1] - y) ** 2 + (points[i + 2] - z) ** 2);
  camera.radius = Math.sqrt(most) || 1;
}

/** The camera's axes (right, up, towards the viewer) when the part is unrolled by f: as the sheet
 * comes to lie flat, the view goes over to one from above with the pattern's x to the right. */
function axesOf(camera, f) {
  const yaw = camera.yaw - 0.44 * f;
  const pitch = Math.min(Math.max(camera.pitch + 0.8 * f, -1.55), 1.55);
  const [c, s] = [Math.cos(yaw), Math.sin(yaw)];
  const [d, t] = [Math.cos(pitch), Math.sin(pitch)];
  return [[-s, c, 0], [-c * t, -s * t, d], [c * d, s * d, t]];
}

/** The matrices, column by column: world to view, and view to the screen's cube. */
function matrices(camera, f, aspect) {
  const [x, y, z] = axesOf(camera, f);
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const away = camera.radius / Math.sin(FIELD / 2) / Math.min(1, aspect) / camera.zoom;
  const shift = [-dot(x, camera.middle) + camera.panX * camera.radius,
    -dot(y, camera.middle) + camera.panY * camera.radius, -dot(z, camera.middle) - away];
  const near = Math.max(away - 3 * camera.radius, away / 50);
  const far = away + 3 * camera.radius;
  const k = 1 / Math.tan(FIELD / 2);
  return {
    view: [x[0], y[0], z[0], 0, x[1], y[1], z[1], 0, x[2], y[2], z[2], 0, ...shift, 1],
    camera: [k / aspect, 0, 0, 0, 0, k, 0, 0, 0, 0, (near + far) / (near - far), -1, 0, 0,
      (2 * near * far) / (near - far), 0],
  };
}

/** Where a point is on a screen of that size, x and y in pixels, and how deep. */
function project(m, size, px, py, pz) {
  const v = m.view;
  const x = v[0] * px + v[4] * py + v[8] * pz + v[12];
  const y = v[1] * px + v[5] * py + v[9] * pz + v[13];
  const z = v[2] * px + v[6] * py + v[10] * pz + v[14];
  return [(0.5 + (0.5 * m.camera[0] * x) / -z) * size[0], (0.5 - (0.5 * m.camera[5] * y) / -z) * size[1], z];
}
