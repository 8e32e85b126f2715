// Frames that are averaged while nothing moves, so that a few rays a pixel are enough.
import {
  BLENDEQUATION_ADD, BLENDMODE_ONE_MINUS_SRC_ALPHA, BLENDMODE_SRC_ALPHA, BlendState, PIXELFORMAT_RGBA16F, RenderPassShaderQuad,
  RenderTarget, SEMANTIC_POSITION, ShaderUtils, Texture,
} from './playcanvas.mjs';

// Colours are linear until they are shown.
const kAdd = `
var source : texture_2d<f32>;
uniform weight : f32;
@fragment fn fragmentMain(input : FragmentInput) -> FragmentOutput {
  var output : FragmentOutput;
  output.color = vec4f(textureLoad(source, vec2i(pcPosition.xy), 0).rgb, uniform.weight);
  return output;
}`;
const kShow = `
var source : texture_2d<f32>;
uniform exposure : f32;
@fragment fn fragmentMain(input : FragmentInput) -> FragmentOutput {
  let linear = saturate(uniform.exposure * textureLoad(source, vec2i(pcPosition.xy), 0).rgb);
  var output : FragmentOutput;
  output.color = vec4f(select(1.055 * pow(linear, vec3f(1.0 / 2.4)) - 0.055, 12.92 * linear, linear < vec3f(0.0031308)), 1.0);
  return output;
}`;

export class Picture {
  #device;
  #mean;
  #add;
  #show;
  frames = 0;

  constructor(device) {
    this.#device = device;
    const target = (name, depth) => new RenderTarget({
      colorBuffer: new Texture(device, { name, width: 1, height: 1, format: PIXELFORMAT_RGBA16F, mipmaps: false }),
      depth,
      flipY: false, // like the canvas, so that a pixel has one place in all
    });
    /** For the camera. */
    this.frame = target('frame', true);
    this.#mean = target('mean', false);
    const pass = (name, fragmentWGSL, to) => {
      const quad = new RenderPassShaderQuad(device);
      quad.shader = ShaderUtils.createShader(device, {
        uniqueName: name, attributes: { vertex_position: SEMANTIC_POSITION }, vertexChunk: 'fullscreenQuadVS', fragmentWGSL,
      });
      quad.init(to);
      return quad;
    };
    this.#add = pass('nifAdd', kAdd, this.#mean);
    this.#add.blendState = new BlendState(true, BLENDEQUATION_ADD, BLENDMODE_SRC_ALPHA, BLENDMODE_ONE_MINUS_SRC_ALPHA);
    this.#show = pass('nifShow', kShow, null);
  }

  resize(width, height) {
    this.frame.resize(width, height);
    this.#mean.resize(width, height);
    this.frames = 0;
  }

  /** The next frame's projection: within a pixel, which smooths edges. */
  shift(projection) {
    const { width, height } = this.frame, n = this.frames;
    projection.data[8] += (2 * ((n * 0.7548776662) % 1) - 1) / width;
    projection.data[9] += (2 * ((n * 0.5698402910) % 1) - 1) / height;
  }

  /** Adds the frame that the camera has drawn, and shows the mean. */
  draw(exposure) {
    const { scope } = this.#device;
    scope.resolve('weight').setValue(1 / ++this.frames);
    scope.resolve('source').setValue(this.frame.colorBuffer);
    this.#add.render();
    scope.resolve('exposure').setValue(exposure);
    scope.resolve('source').setValue(this.#mean.colorBuffer);
    this.#show.render();
  }
}
