// The viewpoint: three.js' camera and its controls, and how the traced picture is placed in it.
import { PerspectiveCamera, Spherical, Vector3 } from './three/three.core.js';
import { OrbitControls } from './three/controls/OrbitControls.js';

const kFov = 40; // degrees, from bottom to top

export class View {
  camera = new PerspectiveCamera(kFov);
  #controls;
  #object;

  constructor(canvas, onChange) {
    this.#controls = new OrbitControls(this.camera, canvas);
    this.#controls.enablePan = false;
    this.#controls.maxPolarAngle = 0.495 * Math.PI; // stays above the ground
    this.#controls.addEventListener('change', onChange);
  }

  /** Shows a whole object: { bounds }. */
  reset(object = this.#object) {
    this.#object = object;
    const [low, high] = object.bounds.map((corner) => new Vector3(...corner));
    this.middle = low.clone().add(high).divideScalar(2);
    /** Radius of the sphere on which the sun moves. */
    this.radius = 0.46 * low.distanceTo(high);
    const half = Math.min(1, this.camera.aspect) * Math.tan((kFov * Math.PI) / 360);
    const distance = (1.12 * this.radius) / Math.sin(Math.atan(half));
    this.#controls.minDistance = 0.3 * distance;
    this.#controls.maxDistance = 4 * distance;
    this.#controls.target.copy(this.middle);
    this.camera.position.setFromSpherical(new Spherical(distance, 1.22, 0.45)).add(this.middle);
    this.#controls.update();
  }

  resize(width, height) {
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
  }

  /** For keys: angles in radians, and a factor on the distance. */
  turn(azimuth, polar, nearer) {
    const from = new Spherical().setFromVector3(this.camera.position.clone().sub(this.middle));
    from.theta += azimuth;
    from.phi = Math.min(this.#controls.maxPolarAngle, Math.max(0.01, from.phi + polar));
    from.radius *= nearer;
    this.camera.position.setFromSpherical(from).add(this.middle);
    this.#controls.update();
  }

  /** In the form that tracer.js needs. */
  traced() {
    this.camera.updateMatrixWorld();
    const [x, y, z] = [0, 1, 2].map((column) => new Vector3().setFromMatrixColumn(this.camera.matrixWorld, column));
    const half = Math.tan((kFov * Math.PI) / 360);
    return {
      position: this.camera.position.toArray(),
      forward: z.negate().toArray(),
      right: x.multiplyScalar(half * this.camera.aspect).toArray(),
      down: y.multiplyScalar(-half).toArray(),
    };
  }
}
