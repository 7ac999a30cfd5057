// One point of a skin or a wall, in mm; bend.x / bend.y is the curvature across the ruling.
attribute vec3 position;
attribute vec3 normal;
attribute vec3 bend;
uniform mat4 camera;
uniform mat4 view;
varying vec3 seenNormal;
varying vec3 seenPoint;
varying vec3 seenBend;

void main() {
  vec4 point = view * vec4(position, 1.0);
  seenPoint = point.xyz;
  seenNormal = (view * vec4(normal, 0.0)).xyz;
  seenBend = bend;
  gl_Position = camera * point;
}
