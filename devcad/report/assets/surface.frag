// Lit from the viewer's left; coloured as a sheet, by curvature or by bend radius.
precision highp float;
varying vec3 seenNormal;
varying vec3 seenPoint;
varying vec3 seenBend; // c, q + v a, and which side: 1 front, -1 back, 0 a wall, 2 both
uniform vec3 front;
uniform vec3 back;
uniform int mode; // 0 sheet, 1 curvature, 2 bend radius
uniform float range; // 1/mm, the curvature at which the colours end
uniform float bent; // 1 as built, 0 flat
uniform vec3 low;
uniform vec3 middle;
uniform vec3 high;

void main() {
  vec3 n = normalize(seenNormal);
  float facing = dot(n, -seenPoint);
  float side = seenBend.z > 1.5 ? sign(facing) : seenBend.z;
  if (facing < 0.0) n = -n;
  vec3 colour = side < -0.5 ? back : front;
  if (mode > 0 && abs(seenBend.z) > 0.5) {
    float h = seenBend.y;
    float c = seenBend.x * bent;
    float most = max(abs(h) * range, 1e-30);
    if (mode == 1) {
      float x = clamp(c / most, -1.0, 1.0);
      colour = x < 0.0 ? mix(middle, low, -x) : mix(middle, high, x);
    } else {
      float octaves = log2(most / max(abs(c), most * 0.03125));
      colour = mix(high, middle, clamp(octaves / 5.0, 0.0, 1.0));
    }
  }
  float sun = max(dot(n, normalize(vec3(-0.45, 0.55, 0.70))), 0.0);
  float shine = pow(max(dot(n, normalize(vec3(-0.2, 0.5, 1.0))), 0.0), 40.0);
  gl_FragColor = vec4(colour * (0.58 + 0.42 * sun) + 0.10 * shine, 1.0);
}
