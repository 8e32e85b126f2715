// The page: an object on the ground, with PlayCanvas' camera, lights and materials, and what it costs.
import {
  AppBase, AppOptions, CameraComponentSystem, Color, ContainerHandler, DEVICETYPE_WEBGPU, Entity, GAMMA_NONE, LightComponentSystem,
  Quat, RenderComponentSystem, StandardMaterial, TONEMAP_NONE, TextureHandler, Vec3, createGraphicsDevice,
} from './playcanvas.mjs';
import { Asker, loadObject } from './nif.js';
import { bindObject, light } from './material.js';
import { Picture } from './picture.js';

// The light, as test.sh gives it to `nif render`.
const kSunIrradiance = [2.9, 2.6, 2.15], kSkyRadiance = [0.36, 0.45, 0.58], kSunAngle = 4, kExposure = 0.95;
const kAlbedo = { object: 0.6, ground: 0.8 }, kFov = 40, kFrames = 128, kGroundSize = 400, kDegree = Math.PI / 180;
const $ = (id) => document.getElementById(id);

function say(text, wrong = false) {
  $('message').textContent = text;
  $('message').classList.toggle('wrong', wrong);
}

/** PlayCanvas takes colours as screens have them, and makes them linear. */
const colour = (linear) => new Color(...linear).gamma();

async function openApp(canvas) {
  if (!navigator.gpu) throw new Error('This page needs WebGPU, which this browser does not have');
  const adapter = await navigator.gpu.requestAdapter();
  if (!adapter) throw new Error('This page needs WebGPU, for which this browser finds no device');
  const device = await createGraphicsDevice(canvas, { deviceTypes: [DEVICETYPE_WEBGPU], antialias: false });
  if (!device.isWebGPU) throw new Error('This page needs WebGPU, and PlayCanvas could not start it');
  device.wgpu.lost.then(({ reason, message }) => reason !== 'destroyed' && say(`The device is lost: ${message}`, true));
  const options = new AppOptions();
  options.graphicsDevice = device;
  options.componentSystems = [RenderComponentSystem, CameraComponentSystem, LightComponentSystem];
  options.resourceHandlers = [TextureHandler, ContainerHandler];
  const app = new AppBase(canvas);
  app.init(options);
  app.autoRender = false;
  return app;
}

function loadMesh(app, url) {
  return new Promise((resolve, reject) => {
    app.assets.loadFromUrl(url, 'container', (error, asset) => {
      if (error) reject(new Error(`${url} cannot be read: ${error}`));
      else resolve(asset.resource.instantiateRenderEntity());
    });
  });
}

function kilobytes(bytes) {
  return `${(bytes / 1000).toFixed(bytes < 100_000 ? 1 : 0)} kB`;
}

async function main() {
  const canvas = $('canvas');
  const loading = loadObject('object.words.gz', 'nif.wgsl.gz');
  loading.catch(() => {}); // reported below, after what concerns the browser
  const app = await openApp(canvas), device = app.graphicsDevice, { queue } = device.wgpu;
  const meshLoading = loadMesh(app, 'object.glb');
  meshLoading.catch(() => {});
  const object = await loading;
  object.checkLimits(device.wgpu.limits);
  const mesh = await meshLoading;

  const [low, high] = object.bounds.map((corner) => new Vec3(corner));
  const middle = new Vec3().lerp(low, high, 0.5), diagonal = low.distance(high);
  const set = bindObject(device, object);
  set('sunRadius', Math.tan((kSunAngle / 2) * kDegree));
  const materialOf = (albedo) => {
    const material = new StandardMaterial();
    material.diffuse = colour([albedo, albedo, albedo]);
    light(material, device, object);
    return material;
  };
  const add = (name, component, properties) => {
    const entity = new Entity(name);
    entity.addComponent(component, properties);
    app.root.addChild(entity);
    return entity;
  };
  const ground = add('ground', 'render', { type: 'plane', material: materialOf(kAlbedo.ground) });
  ground.setLocalScale(kGroundSize * diagonal, 1, kGroundSize * diagonal);
  ground.setPosition(middle.x, low.y, middle.z);
  const material = materialOf(kAlbedo.object);
  const drawn = mesh.findComponents('render').flatMap((render) => render.meshInstances);
  for (const instance of drawn) instance.material = material;
  app.root.addChild(mesh);
  // A light of the engine's, which casts no shadow as far as the engine knows. Its materials reflect albedo times light, without
  // the 1 / pi of a surface that scatters evenly.
  const sun = add('sun', 'light', { type: 'directional', color: colour(kSunIrradiance.map((x) => x / Math.PI)) });
  app.scene.ambientLight = colour(kSkyRadiance);

  const picture = new Picture(device);
  const camera = add('camera', 'camera', {
    clearColor: new Color(...kSkyRadiance), renderTarget: picture.frame, toneMapping: TONEMAP_NONE, gammaCorrection: GAMMA_NONE,
  });
  camera.camera.calculateProjection = (matrix) => {
    matrix.setPerspective(kFov, picture.frame.width / picture.frame.height, 0.01 * diagonal, kGroundSize * diagonal);
    picture.shift(matrix);
  };
  const half = Math.min(1, canvas.clientWidth / canvas.clientHeight) * Math.tan((kFov / 2) * kDegree);
  const view = { distance: (0.42 * diagonal) / Math.sin(Math.atan(half)), around: 25, up: 15 };
  const nearest = 0.2 * view.distance, farthest = 4 * view.distance, sunDirection = new Vec3();
  let wake = () => {};
  const fromAngles = (around, up) => {
    const level = Math.cos(up * kDegree);
    return new Vec3(level * Math.sin(around * kDegree), Math.sin(up * kDegree), level * Math.cos(around * kDegree));
  };
  function change() {
    camera.setPosition(fromAngles(view.around, view.up).mulScalar(view.distance).add(middle));
    camera.lookAt(middle);
    sunDirection.copy(fromAngles($('azimuth').valueAsNumber, $('elevation').valueAsNumber));
    sun.setRotation(new Quat().setFromDirections(Vec3.UP, sunDirection)); // lights shine down
    picture.frames = 0;
    wake();
  }
  for (const id of ['azimuth', 'elevation']) $(id).addEventListener('input', change);
  canvas.addEventListener('pointerdown', (event) => canvas.setPointerCapture(event.pointerId));
  canvas.addEventListener('pointermove', (event) => {
    if (!event.buttons) return;
    view.around -= 0.3 * event.movementX;
    view.up = Math.min(88, Math.max(2, view.up + 0.3 * event.movementY));
    change();
  });
  canvas.addEventListener('wheel', (event) => {
    event.preventDefault();
    view.distance = Math.min(farthest, Math.max(nearest, view.distance * Math.exp(0.001 * event.deltaY)));
    change();
  }, { passive: false });
  function resize() {
    const width = Math.max(1, canvas.clientWidth), height = Math.max(1, canvas.clientHeight);
    device.resizeCanvas(width, height);
    picture.resize(width, height);
    wake();
  }
  new ResizeObserver(resize).observe(canvas);
  resize();
  change();

  $('words').textContent = `${kilobytes(object.words.byteLength)}; ${kilobytes(object.wire.words)} packed`;
  $('text').textContent = `${kilobytes(object.text.length)}; ${kilobytes(object.wire.text)} packed`;
  $('wire').textContent = kilobytes(object.wire.words + object.wire.text);
  $('drawn').textContent = (drawn.reduce((sum, { mesh: { primitive } }) => sum + primitive[0].count, 0) / 3).toLocaleString('en');
  document.body.dataset.loaded = Math.round(performance.now());
  say('');

  let asker;
  // For tests.
  window.sample = {
    bias: object.bias,
    bounds: object.bounds,
    state: () => ({
      sun: [sunDirection.x, sunDirection.y, sunDirection.z],
      camera: [camera.getPosition().x, camera.getPosition().y, camera.getPosition().z],
      target: [middle.x, middle.y, middle.z],
      size: [canvas.width, canvas.height],
      exposure: kExposure,
      sunIrradiance: kSunIrradiance,
      skyRadiance: kSkyRadiance,
      sunAngle: kSunAngle,
      albedo: kAlbedo,
      fov: kFov,
      groundSize: kGroundSize,
    }),
    visible: async (list) => Array.from((await asker.visible(new Float32Array(list))).visible),
  };
  app.on('postrender', () => picture.draw(kExposure));
  app.start();
  for (let number = 1; ; ++number) {
    if (picture.frames >= kFrames) await new Promise((resolve) => (wake = resolve));
    set('frame', number);
    app.renderNextFrame = true;
    let start;
    app.once('prerender', () => (start = performance.now()));
    await new Promise((resolve) => app.once('frameend', resolve));
    await queue.onSubmittedWorkDone();
    const now = performance.now();
    document.body.dataset.frames = picture.frames;
    $('frame').textContent = `${(now - start).toFixed(1)} ms`;
    if (number === 1) {
      document.body.dataset.first = Math.round(now);
      $('first').textContent = `${Math.round(now)} ms`;
      asker = await Asker.create(device.wgpu, object);
    } else if (number === 2) {
      const rate = await asker.rate();
      $('rate').textContent = `${(rate / 1e6).toPrecision(2)} million`;
    }
  }
}

main().catch((error) => {
  console.warn(error);
  say(String(error?.message ?? error), true);
});
