// A line is drawn a little nearer to the eye than the skin that it lies on.
attribute vec3 position;
uniform mat4 camera;
uniform mat4 view;

void main() {
  vec4 point = view * vec4(position, 1.0);
  gl_Position = camera * vec4(0.999 * point.xyz, 1.0);
  gl_PointSize = 4.0;
}
