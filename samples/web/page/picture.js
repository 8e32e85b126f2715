// Shows the traced picture: a three.js scene with one triangle that covers the canvas, coloured by the traced sums.
import { BufferAttribute, BufferGeometry, Camera, DataTexture, FloatType, Mesh, RGBAFormat, Scene, ShaderMaterial, Vector2, Vector3 } from './three/three.core.js';
import { WebGLRenderer } from './three/three.module.js';
import { kLight } from './light.js';

const kCamera = new Camera(); // three.js needs one; the shader does not

const kVertex = 'void main() { gl_Position = vec4(position, 1.0); }';

// Bilinear in the shader, because few phones filter float textures.
const kFragment = `
uniform sampler2D traced;
uniform vec2 size;
uniform vec3 sun, sky;
uniform float exposure;
vec3 lit(ivec2 at) {
  vec4 sums = texelFetch(traced, clamp(at, ivec2(0), ivec2(size) - 1), 0);
  return exposure * (sums.x * sun / PI + sums.y * sky + sums.z * sky);
}
void main() {
  vec2 at = gl_FragCoord.xy / screen * size - 0.5;
  at.y = size.y - 1.0 - at.y; // rows go down
  ivec2 corner = ivec2(floor(at));
  vec2 part = at - vec2(corner);
  vec3 colour = mix(mix(lit(corner), lit(corner + ivec2(1, 0)), part.x), mix(lit(corner + ivec2(0, 1)), lit(corner + 1), part.x), part.y);
  colour = clamp(colour, 0.0, 1.0);
  gl_FragColor = vec4(mix(12.92 * colour, 1.055 * pow(colour, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, colour)), 1.0);
}`;

/** Draws on a canvas. */
export class Picture {
  #renderer;
  #scene = new Scene();
  #material;
  #texture;

  /** Throws if there is no WebGL 2. */
  constructor(canvas) {
    if (!canvas.getContext('webgl2', { antialias: false })) throw new Error('This page needs WebGL 2, which this browser does not have or has switched off.');
    this.#renderer = new WebGLRenderer({ canvas, antialias: false });
    this.#material = new ShaderMaterial({
      vertexShader: kVertex,
      fragmentShader: `#define PI ${Math.PI}\nuniform vec2 screen;${kFragment}`,
      uniforms: {
        traced: { value: null },
        size: { value: new Vector2(1, 1) },
        screen: { value: new Vector2(1, 1) },
        sun: { value: new Vector3(...kLight.sunIrradiance) },
        sky: { value: new Vector3(...kLight.skyRadiance) },
        exposure: { value: kLight.exposure },
      },
      depthTest: false,
      depthWrite: false,
    });
    const triangle = new BufferGeometry().setAttribute('position', new BufferAttribute(Float32Array.of(-1, -1, 0, 3, -1, 0, -1, 3, 0), 3));
    const mesh = new Mesh(triangle, this.#material);
    mesh.frustumCulled = false;
    this.#scene.add(mesh);
    this.show(Float32Array.of(0, 0, 1, 1), 1, 1); // the sky; and the shader is compiled while the object loads
  }

  /** Sets the number of pixels of the canvas. */
  resize(width, height) {
    this.#renderer.setSize(width, height, false);
    this.#material.uniforms.screen.value.set(width, height);
    this.draw();
  }

  /** Shows sums of tracer.js, four numbers per pixel, in any size. */
  show(sums, width, height) {
    if (this.#texture?.image.width !== width || this.#texture?.image.height !== height) {
      this.#texture?.dispose();
      this.#texture = new DataTexture(new Float32Array(4 * width * height), width, height, RGBAFormat, FloatType);
      this.#material.uniforms.traced.value = this.#texture;
      this.#material.uniforms.size.value.set(width, height);
    }
    this.#texture.image.data.set(sums);
    this.#texture.needsUpdate = true;
    this.draw();
  }

  draw() {
    if (this.#texture) this.#renderer.render(this.#scene, kCamera);
  }
}
