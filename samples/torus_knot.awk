# Writes a closed mesh of 144,000 triangles as OBJ text: a (2,3) torus knot whose tube has ribs and bumps.
# For samples/run.sh, if no scanned model is available. Run with LC_ALL=C, so that numbers have a decimal point.

function knot(u, p,    r) {
  r = 2 + 0.8 * cos(3 * u)
  p[0] = r * cos(2 * u); p[1] = r * sin(2 * u); p[2] = 1.1 * sin(3 * u)
}

function cross(a, b, c) {
  c[0] = a[1] * b[2] - a[2] * b[1]; c[1] = a[2] * b[0] - a[0] * b[2]; c[2] = a[0] * b[1] - a[1] * b[0]
}

function normalise(a,    size) {
  size = sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])
  a[0] /= size; a[1] /= size; a[2] /= size
}

BEGIN {
  around = 900; across = 80
  turn = 2 * atan2(0, -1)
  print "o torus_knot"
  for (i = 0; i < around; ++i) {
    u = turn * i / around
    knot(u, p); knot(u + 1e-4, q); knot(u - 1e-4, o)
    for (a = 0; a < 3; ++a) tangent[a] = q[a] - o[a]
    # A frame that only depends on u, so that the tube closes.
    cross(tangent, p, side); normalise(side)
    cross(side, tangent, up); normalise(up)
    for (k = 0; k < across; ++k) {
      v = turn * k / across
      r = 0.36 * (1 + 0.14 * sin(8 * v + 12 * u) + 0.07 * sin(90 * u) * cos(5 * v))
      x = r * cos(v); y = r * sin(v)
      printf "v %.6f %.6f %.6f\n", p[0] + x * up[0] + y * side[0], p[1] + x * up[1] + y * side[1], \
             p[2] + x * up[2] + y * side[2]
    }
  }
  for (i = 0; i < around; ++i) {
    next_ring = (i + 1) % around
    for (k = 0; k < across; ++k) {
      next_k = (k + 1) % across
      a = i * across + k + 1; b = next_ring * across + k + 1
      c = next_ring * across + next_k + 1; d = i * across + next_k + 1
      printf "f %d %d %d\nf %d %d %d\n", a, c, b, a, d, c
    }
  }
}
