// Generates the rays of a picture, has them answered, and accumulates the results.
//
// A view has: width, height, in pixels; camera: position, forward, right and down, of which the last two extend to the picture's
// edges; ground: { height, middle: [x, z], half, bias }, a square; sun: { direction, angle }, its diameter in degrees; and
// albedo: { object, ground }.

const kRay = 8; // numbers per ray: origin, tmin, direction, tmax
const kTurn = 2 * Math.PI;

/** Each sample of a pixel has six numbers. Those of successive samples fill the unit cube evenly (Roberts' R sequence). */
const kDimensions = 6;
const kSteps = (() => {
  let root = 1;
  for (let i = 0; i < 64; ++i) root = Math.pow(1 + root, 1 / (kDimensions + 1));
  return Array.from({ length: kDimensions }, (_, i) => Math.pow(root, -1 - i) % 1);
})();

/** A number in 0..1 for each pixel and dimension, by which that pixel's samples are shifted. */
function shift(pixel, dimension) {
  let h = Math.imul(pixel, 0x9e3779b1) ^ Math.imul(dimension + 1, 0x85ebca6b);
  h = Math.imul(h ^ (h >>> 16), 0x7feb352d);
  h = Math.imul(h ^ (h >>> 15), 0x846ca68b);
  return ((h ^ (h >>> 16)) >>> 0) / 2 ** 32;
}
const number = (pixel, pass, dimension) => (shift(pixel, dimension) + pass * kSteps[dimension]) % 1;

/** Writes a unit vector: `along` the axis, the rest perpendicular to it, rotated by `angle`. */
function about(axis, along, angle, rays, at) {
  const [nx, ny, nz] = axis;
  const sign = nz >= 0 ? 1 : -1, a = -1 / (sign + nz), b = nx * ny * a; // Duff et al. 2017, a basis without branches
  const across = Math.sqrt(Math.max(0, 1 - along * along));
  const u = across * Math.cos(angle), v = across * Math.sin(angle);
  rays[at] = nx * along + u * (1 + sign * nx * nx * a) + v * b;
  rays[at + 1] = ny * along + u * sign * b + v * (sign + ny * ny * a);
  rays[at + 2] = nz * along - u * sign * nx - v * ny;
}

export class Tracer {
  #answerer;
  #view;
  #sums = new Map(); // first row of a band: the sum of its samples
  #room = 0;

  constructor(answerer) {
    this.#answerer = answerer;
  }

  /** Throws if the object cannot answer the queries of pictures. */
  try() {
    this.#reserve(1);
    this.#rays.set([0, 0, 0, 0, 0, 0, 1, Infinity]);
    this.#answerer.intersect(this.#rays, 1, this.#hits);
    this.#answerer.visible(this.#rays, 1, this.#visible);
  }

  start(view) {
    this.#view = view;
    this.#sums.clear();
  }

  /**
   * One more sample of each pixel in `rows` rows from `first`, number `pass`. Returns the means so far, four numbers per pixel:
   * reflected sunlight, reflected skylight, how much sky is seen, and 1. A surface that faces the sun receives 1.
   */
  trace({ first, rows, pass }) {
    const { width } = this.#view;
    const count = width * rows;
    if (pass === 0 || !this.#sums.has(first)) this.#sums.set(first, new Float32Array(4 * count));
    const sums = this.#sums.get(first);
    const asked = this.#shadowRays(this.#view, { start: first * width, count, stride: 1 }, pass, (pixel) => (sums[4 * pixel + 2] += 1));
    this.#answerer.visible(this.#shadows, asked, this.#visible);
    for (let i = 0; i < asked; ++i) if (this.#visible[i] !== 0) sums[4 * this.#pixels[i] + (this.#weights[i] < 0 ? 1 : 0)] += Math.abs(this.#weights[i]);
    return sums.map((sum, i) => (i % 4 === 3 ? 1 : sum / (pass + 1)));
  }

  /** The shadow rays of at most `most` pixels spread over a view, those that start on the object. */
  rays(view, most) {
    const pixels = view.width * view.height, stride = Math.ceil(pixels / most);
    const objectAlone = { ...view, ground: { ...view.ground, half: -1 } };
    const asked = this.#shadowRays(objectAlone, { start: 0, count: Math.floor(pixels / stride), stride }, 0, () => {});
    return this.#shadows.slice(0, kRay * asked);
  }

  /**
   * Makes #shadows with #pixels and #weights (negative: of the sky) for `count` pixels from `start`, every `stride`th. Returns
   * their number. Calls `behind(i)` if pixel i of these sees the sky.
   */
  #shadowRays(view, { start, count, stride }, pass, behind) {
    this.#reserve(count);
    const { width, height, camera, ground, sun, albedo } = view;
    const rays = this.#rays, { t, normal, bias } = this.#hits;
    for (let i = 0; i < count; ++i) {
      const pixel = start + i * stride;
      const x = (2 * ((pixel % width) + number(pixel, pass, 0))) / width - 1;
      const y = (2 * (Math.floor(pixel / width) + number(pixel, pass, 1))) / height - 1;
      let square = 0;
      for (let a = 0; a < 3; ++a) {
        const d = camera.forward[a] + x * camera.right[a] + y * camera.down[a];
        rays[kRay * i + a] = camera.position[a];
        rays[kRay * i + 4 + a] = d;
        square += d * d;
      }
      for (let a = 4; a < 7; ++a) rays[kRay * i + a] /= Math.sqrt(square);
      rays[kRay * i + 3] = 0;
      rays[kRay * i + 7] = Infinity;
    }
    this.#answerer.intersect(rays, count, this.#hits);

    const shadows = this.#shadows, narrow = 1 - Math.cos((sun.angle * kTurn) / 720);
    const n = [0, 0, 0], d = [0, 0, 0];
    let asked = 0;
    for (let i = 0; i < count; ++i) {
      const at = kRay * i, pixel = start + i * stride;
      const level = this.#meetsGround(ground, rays, at);
      const onGround = level < t[i];
      const distance = onGround ? level : t[i];
      if (distance === Infinity) {
        behind(i);
        continue;
      }
      const off = onGround ? ground.bias : bias[i];
      for (let a = 0; a < 3; ++a) n[a] = onGround ? (a === 1 ? (rays[at + 1] > ground.height ? 1 : -1) : 0) : normal[3 * i + a];
      const reflects = onGround ? albedo.ground : albedo.object;
      for (let light = 0; light < 2; ++light) {
        const to = kRay * asked;
        const u = number(pixel, pass, 2 + 2 * light), angle = kTurn * number(pixel, pass, 3 + 2 * light);
        if (light === 0) about(sun.direction, 1 - u * narrow, angle, shadows, to + 4);
        else about(n, Math.sqrt(1 - u), angle, shadows, to + 4);
        for (let a = 0; a < 3; ++a) d[a] = shadows[to + 4 + a];
        const cosine = n[0] * d[0] + n[1] * d[1] + n[2] * d[2];
        if (!(cosine > 0)) continue;
        for (let a = 0; a < 3; ++a) shadows[to + a] = rays[at + a] + distance * rays[at + 4 + a] + off * n[a];
        shadows[to + 3] = 0;
        shadows[to + 7] = Infinity;
        if (this.#meetsGround(ground, shadows, to) < Infinity) continue;
        this.#pixels[asked] = i;
        // The sky's rays are distributed by the cosine, so each counts fully.
        this.#weights[asked++] = light === 0 ? reflects * cosine : -reflects;
      }
    }
    return asked;
  }

  /** The distance along a ray to the ground, or Infinity. */
  #meetsGround(ground, rays, at) {
    const t = (ground.height - rays[at + 1]) / rays[at + 5];
    if (!(t > 0)) return Infinity;
    const x = rays[at] + t * rays[at + 4] - ground.middle[0], z = rays[at + 2] + t * rays[at + 6] - ground.middle[1];
    return Math.abs(x) <= ground.half && Math.abs(z) <= ground.half ? t : Infinity;
  }

  // Arrays for the largest number of pixels in a band so far.
  #rays;
  #hits;
  #shadows;
  #pixels;
  #weights;
  #visible;
  #reserve(count) {
    if (count <= this.#room) return;
    this.#room = count;
    this.#rays = new Float32Array(kRay * count);
    this.#hits = { t: new Float32Array(count), normal: new Float32Array(3 * count), bias: new Float32Array(count) };
    this.#shadows = new Float32Array(2 * kRay * count + kRay);
    this.#pixels = new Uint32Array(2 * count);
    this.#weights = new Float32Array(2 * count);
    this.#visible = new Uint8Array(2 * count);
  }
}
