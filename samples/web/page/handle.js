// The sun in the picture: a button that can be dragged and moved by arrow keys.
import { Raycaster, Vector2, Vector3 } from './three/three.core.js';

const kInside = 0.93; // of half the picture: it stays where it can be grabbed

export class SunHandle {
  #button;
  #stage;
  #view;
  #sun;

  constructor(button, stage, view, sun, onMove) {
    this.#button = button;
    this.#stage = stage;
    this.#view = view;
    this.#sun = sun;
    let isFront;
    button.addEventListener('pointerdown', (event) => {
      button.setPointerCapture(event.pointerId);
      // A point in the picture is two points on the sphere: the sun stays on its side.
      isFront = new Vector3(...sun.direction).dot(view.camera.position.clone().sub(view.middle)) >= 0;
      event.preventDefault();
      button.focus({ focusVisible: false });
    });
    button.addEventListener('pointermove', (event) => {
      if (!button.hasPointerCapture(event.pointerId)) return;
      sun.direction = this.#directionAt(event.clientX, event.clientY, isFront);
      onMove();
    });
  }

  /** Moves the button to the sun. */
  place() {
    const { direction, azimuth, elevation } = this.#sun;
    const at = new Vector3(...direction).multiplyScalar(this.#view.radius).add(this.#view.middle);
    this.#view.camera.updateMatrixWorld();
    at.project(this.#view.camera);
    const [x, y] = [at.x, at.y].map((value) => Math.min(kInside, Math.max(-kInside, value)));
    this.#button.style.left = `${50 + 50 * x}%`;
    this.#button.style.top = `${50 - 50 * y}%`;
    this.#button.setAttribute('aria-label', `The sun: ${Math.round(elevation)} degrees high, at ${Math.round(azimuth) % 360} degrees. Drag it, or press arrow keys.`);
    this.#button.hidden = false;
  }

  #directionAt(clientX, clientY, isFront) {
    const { left, top, width, height } = this.#stage.getBoundingClientRect();
    const { camera, middle, radius } = this.#view;
    const caster = new Raycaster();
    caster.setFromCamera(new Vector2((2 * (clientX - left)) / width - 1, 1 - (2 * (clientY - top)) / height), camera);
    const nearest = caster.ray.closestPointToPoint(middle, new Vector3());
    const inside = radius ** 2 - nearest.distanceToSquared(middle);
    if (inside > 0) nearest.addScaledVector(caster.ray.direction, Math.sqrt(inside) * (isFront ? -1 : 1));
    return nearest.sub(middle).normalize().toArray();
  }
}
