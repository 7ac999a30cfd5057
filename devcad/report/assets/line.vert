attribute vec3 position;
uniform mat4 camera;
uniform mat4 view;

void main() {
  gl_Position = camera * view * vec4(position, 1.0);
  gl_PointSize = 4.0;
}
