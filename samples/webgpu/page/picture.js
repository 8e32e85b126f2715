// Frames that are averaged while nothing moves, so that a few rays a pixel are enough.
import { FloatType, HalfFloatType, MeshBasicNodeMaterial, QuadMesh, RenderTarget } from './three/three.webgpu.js';
import { mix, texture, uniform } from './three/three.tsl.js';

export class Picture {
  #renderer;
  #frame = new RenderTarget(1, 1, { type: HalfFloatType });
  #means = [0, 1].map(() => new RenderTarget(1, 1, { type: FloatType, depthBuffer: false }));
  #weight = uniform(1);
  #old = texture(this.#means[0].texture);
  #shown = texture(this.#means[0].texture);
  #add = new QuadMesh(new MeshBasicNodeMaterial());
  #show = new QuadMesh(new MeshBasicNodeMaterial());
  frames = 0;

  constructor(renderer) {
    this.#renderer = renderer;
    this.#add.material.colorNode = mix(this.#old, texture(this.#frame.texture), this.#weight);
    this.#show.material.colorNode = this.#shown;
  }

  resize(width, height) {
    for (const target of [this.#frame, ...this.#means]) target.setSize(width, height);
    this.frames = 0;
  }

  /** One more frame. The camera is moved within a pixel, which smooths edges. */
  draw(scene, camera) {
    const { width, height } = this.#frame, renderer = this.#renderer, n = this.frames++;
    camera.setViewOffset(width, height, ((n * 0.7548776662) % 1) - 0.5, ((n * 0.5698402910) % 1) - 0.5, width, height);
    renderer.setRenderTarget(this.#frame);
    renderer.render(scene, camera);
    camera.clearViewOffset();
    this.#weight.value = 1 / (n + 1);
    this.#old.value = this.#means[n % 2].texture;
    renderer.setRenderTarget(this.#means[(n + 1) % 2]);
    this.#add.render(renderer);
    this.#shown.value = this.#means[(n + 1) % 2].texture;
    renderer.setRenderTarget(null);
    this.#show.render(renderer);
  }
}
