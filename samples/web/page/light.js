// The lights: sun, sky, and exposure. test.sh uses the same numbers for the picture of `nif render`.

export const kLight = {
  /** Its diameter in degrees, for softer shadows than the real sun's half a degree. */
  sunAngle: 4,
  /** On a surface that faces the sun; linear red, green and blue. */
  sunIrradiance: [2.9, 2.6, 2.15],
  /** From all directions. */
  skyRadiance: [0.36, 0.45, 0.58],
  exposure: 0.95,
  albedo: { object: 0.6, ground: 0.8 },
  /** Side of the ground, in diagonals of the object's box, large enough to reach the horizon. */
  groundSize: 400,
};

/** The ground below an object, in the form that tracer.js needs. */
export function groundOf({ bounds: [low, high], longest }) {
  const diagonal = Math.hypot(...high.map((value, a) => value - low[a]));
  const middle = [(low[0] + high[0]) / 2, (low[2] + high[2]) / 2];
  return { height: low[1], middle, half: (kLight.groundSize * diagonal) / 2, bias: longest / 1000 };
}

const kDegree = Math.PI / 180;

/** The sun's position in the sky. Azimuth and elevation in degrees. */
export class Sun {
  static kLowest = 3;
  constructor() {
    this.reset();
  }
  reset() {
    this.set(70, 40);
  }
  set(azimuth, elevation) {
    this.azimuth = ((azimuth % 360) + 360) % 360;
    this.elevation = Math.min(90, Math.max(Sun.kLowest, elevation));
  }
  move(azimuth, elevation) {
    this.set(this.azimuth + azimuth, this.elevation + elevation);
  }
  get direction() {
    const across = Math.cos(this.elevation * kDegree);
    return [across * Math.sin(this.azimuth * kDegree), Math.sin(this.elevation * kDegree), across * Math.cos(this.azimuth * kDegree)];
  }
  set direction([x, y, z]) {
    this.set(Math.atan2(x, z) / kDegree, Math.atan2(y, Math.hypot(x, z)) / kDegree);
  }
}
