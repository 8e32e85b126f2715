// The page: an object on the ground, with three.js' camera, lights and materials, and what it costs.
import {
  AmbientLight, Color, DirectionalLight, LinearToneMapping, Mesh, MeshLambertNodeMaterial, PerspectiveCamera, PlaneGeometry, Scene,
  Spherical, Vector3, WebGPURenderer,
} from './three/three.webgpu.js';
import { GLTFLoader } from './three/loaders/GLTFLoader.js';
import { OrbitControls } from './three/controls/OrbitControls.js';
import { Asker, loadObject } from './nif.js';
import { makeNodes } from './nodes.js';
import { Picture } from './picture.js';

// The light, as test.sh gives it to `nif render`.
const kSunIrradiance = [2.9, 2.6, 2.15], kSkyRadiance = [0.36, 0.45, 0.58], kSunAngle = 4, kExposure = 0.95;
const kAlbedo = { object: 0.6, ground: 0.8 }, kFov = 40, kFrames = 256, kGroundSize = 400, kDegree = Math.PI / 180;
const $ = (id) => document.getElementById(id);

function say(text, wrong = false) {
  $('message').textContent = text;
  $('message').classList.toggle('wrong', wrong);
}

async function openRenderer(canvas) {
  if (!navigator.gpu) throw new Error('This page needs WebGPU, which this browser does not have');
  const adapter = await navigator.gpu.requestAdapter();
  if (!adapter) throw new Error('This page needs WebGPU, for which this browser finds no device');
  const renderer = new WebGPURenderer({ canvas });
  await renderer.init();
  if (!renderer.backend.isWebGPUBackend) throw new Error('This page needs WebGPU, and three.js could not start it');
  renderer.backend.device.lost.then(({ reason, message }) => reason !== 'destroyed' && say(`The device is lost: ${message}`, true));
  return renderer;
}

async function loadMesh(url) {
  let gltf;
  try {
    gltf = await new GLTFLoader().loadAsync(url);
  } catch (error) {
    throw new Error(`${url} cannot be read: ${error.message}`);
  }
  const meshes = [];
  gltf.scene.traverse((node) => node.isMesh && meshes.push(node));
  if (meshes.length !== 1) throw new Error(`${url} has ${meshes.length} meshes; this page draws one`);
  const { geometry } = meshes[0];
  if (!geometry.getAttribute('normal')) geometry.computeVertexNormals();
  return geometry;
}

function kilobytes(bytes) {
  return `${(bytes / 1000).toFixed(bytes < 100_000 ? 1 : 0)} kB`;
}

async function main() {
  const canvas = $('canvas');
  const loading = [loadObject('object.words.gz', 'nif.wgsl.gz'), loadMesh('object.glb')];
  loading.forEach((promise) => promise.catch(() => {})); // reported below, after what concerns the browser
  const renderer = await openRenderer(canvas);
  const object = await loading[0];
  object.checkLimits(renderer.backend.device.limits);
  const geometry = await loading[1];

  const [low, high] = object.bounds.map((corner) => new Vector3(...corner));
  const middle = low.clone().add(high).divideScalar(2), diagonal = low.distanceTo(high);
  const scene = new Scene(), sunDirection = new Vector3(), sun = new DirectionalLight(new Color(...kSunIrradiance), 1);
  const nodes = makeNodes(object, sunDirection);
  nodes.sunRadius.value = Math.tan((kSunAngle / 2) * kDegree);
  // The sun's shadow by the asset, instead of a shadow map.
  renderer.shadowMap.enabled = true;
  sun.castShadow = true;
  sun.shadow.shadowNode = nodes.shadow;
  const materialOf = (albedo) => {
    const material = new MeshLambertNodeMaterial({ color: new Color(albedo, albedo, albedo) });
    material.aoNode = nodes.occlusion;
    return material;
  };
  const ground = new Mesh(new PlaneGeometry(kGroundSize * diagonal, kGroundSize * diagonal).rotateX(-Math.PI / 2), materialOf(kAlbedo.ground));
  ground.position.set(middle.x, low.y, middle.z);
  const mesh = new Mesh(geometry, materialOf(kAlbedo.object));
  mesh.receiveShadow = ground.receiveShadow = true;
  // From a sky of radiance L, a surface receives pi L.
  scene.add(ground, mesh, sun, sun.target, new AmbientLight(new Color(...kSkyRadiance), Math.PI));
  scene.background = new Color(...kSkyRadiance);
  renderer.toneMapping = LinearToneMapping;
  renderer.toneMappingExposure = kExposure;

  const picture = new Picture(renderer);
  const camera = new PerspectiveCamera(kFov, 1, 0.01 * diagonal, kGroundSize * diagonal);
  const controls = new OrbitControls(camera, canvas);
  controls.enablePan = false;
  controls.maxPolarAngle = 0.495 * Math.PI;
  controls.target.copy(middle);
  const half = Math.min(1, canvas.clientWidth / canvas.clientHeight) * Math.tan((kFov / 2) * kDegree);
  const distance = (0.42 * diagonal) / Math.sin(Math.atan(half));
  camera.position.setFromSpherical(new Spherical(distance, 75 * kDegree, 25 * kDegree)).add(middle);
  controls.update();
  let wake = () => {};
  const change = () => {
    picture.frames = 0;
    wake();
  };
  controls.addEventListener('change', change);
  function moveSun() {
    const azimuth = $('azimuth').valueAsNumber * kDegree, elevation = $('elevation').valueAsNumber * kDegree;
    sunDirection.set(Math.cos(elevation) * Math.sin(azimuth), Math.sin(elevation), Math.cos(elevation) * Math.cos(azimuth));
    nodes.sun.value.copy(sunDirection);
    sun.position.copy(middle).addScaledVector(sunDirection, diagonal);
    sun.target.position.copy(middle);
    change();
  }
  for (const id of ['azimuth', 'elevation']) $(id).addEventListener('input', moveSun);
  moveSun();
  function resize() {
    const width = Math.max(1, canvas.clientWidth), height = Math.max(1, canvas.clientHeight);
    renderer.setPixelRatio(1);
    renderer.setSize(width, height, false);
    camera.aspect = width / height;
    camera.updateProjectionMatrix();
    picture.resize(width, height);
    wake();
  }
  new ResizeObserver(resize).observe(canvas);
  resize();

  $('words').textContent = `${kilobytes(object.words.byteLength)}; ${kilobytes(object.wire.words)} packed`;
  $('text').textContent = `${kilobytes(object.text.length)}; ${kilobytes(object.wire.text)} packed`;
  $('wire').textContent = kilobytes(object.wire.words + object.wire.text);
  $('drawn').textContent = (geometry.index?.count / 3).toLocaleString('en');
  say('');

  const { queue } = renderer.backend.device;
  let asker, rays = 0;
  // For tests.
  window.sample = {
    bias: object.bias,
    bounds: object.bounds,
    state: () => ({
      sun: sunDirection.toArray(),
      camera: camera.position.toArray(),
      target: controls.target.toArray(),
      size: [renderer.domElement.width, renderer.domElement.height],
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
  for (let first = true; ; first = false) {
    if (picture.frames >= kFrames) await new Promise((resolve) => (wake = resolve));
    ++nodes.frame.value;
    const start = performance.now();
    picture.draw(scene, camera);
    await queue.onSubmittedWorkDone();
    const milliseconds = performance.now() - start;
    document.body.dataset.frames = picture.frames;
    $('frame').textContent = `${milliseconds.toFixed(1)} ms`;
    if (first) {
      document.body.dataset.first = Math.round(performance.now());
      $('first').textContent = `${Math.round(performance.now())} ms`;
      asker = await Asker.create(renderer.backend.device, object);
    } else if (!rays) {
      rays = await measure(asker, object);
      $('rate').textContent = `${(rays / 1e6).toFixed(1)} million`;
      document.body.dataset.rate = rays;
    }
    await new Promise(requestAnimationFrame);
  }
}

/** Rays a second, in a compute pass: lines between random points of the object's box, as many as take a while. */
async function measure(asker, { bounds: [low, high] }) {
  for (let count = 1 << 14; ; count *= 4) {
    const rays = new Float32Array(8 * count);
    for (let i = 0; i < rays.length; i += 8) {
      for (let a = 0; a < 3; ++a) {
        const from = low[a] + Math.random() * (high[a] - low[a]), to = low[a] + Math.random() * (high[a] - low[a]);
        rays[i + a] = from;
        rays[i + 4 + a] = to - from;
      }
      rays[i + 7] = 1e30;
    }
    const { milliseconds } = await asker.visible(rays);
    if (milliseconds > 30 || count >= 1 << 20) return (count / milliseconds) * 1000;
  }
}

main().catch((error) => {
  console.warn(error);
  say(String(error?.message ?? error), true);
});
