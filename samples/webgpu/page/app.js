// The page: an object on the ground, with three.js' camera, lights and materials, and what it costs.
import {
  AmbientLight, Color, DirectionalLight, LinearToneMapping, Mesh, MeshLambertNodeMaterial, PerspectiveCamera, PlaneGeometry, Scene,
  Spherical, Vector3, WebGPURenderer,
} from './three/three.webgpu.js';
import { GLTFLoader } from './three/loaders/GLTFLoader.js';
import { OrbitControls } from './three/controls/OrbitControls.js';
import { Asker, loadObject, randomRays } from './nif.js';
import { RayPass, assetAnswers, makeNodes, makeUniforms } from './nodes.js';
import { Picture } from './picture.js';

// The light, as test.sh gives it to `nif render`.
const kSunIrradiance = [2.9, 2.6, 2.15], kSkyRadiance = [0.36, 0.45, 0.58], kSunAngle = 4, kExposure = 0.95;
const kAlbedo = { object: 0.6, ground: 0.8 }, kFov = 40, kFrames = 256, kGroundSize = 400, kLines = 1 << 16;
const kDegree = Math.PI / 180;
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
  const scene = new Scene(), sunDirection = new Vector3(), uniforms = makeUniforms(sunDirection, object.bias);
  uniforms.sunRadius.value = Math.tan((kSunAngle / 2) * kDegree);
  const ground = new Mesh(new PlaneGeometry(kGroundSize * diagonal, kGroundSize * diagonal).rotateX(-Math.PI / 2));
  ground.position.set(middle.x, low.y, middle.z);
  const mesh = new Mesh(geometry);
  mesh.receiveShadow = ground.receiveShadow = true;
  // From a sky of radiance L, a surface receives pi L.
  scene.add(ground, mesh, new AmbientLight(new Color(...kSkyRadiance), Math.PI));
  renderer.shadowMap.enabled = true;

  /** A sun whose shadow is by rays, instead of a shadow map, and materials whose occlusion is, by whoever answers them. */
  function makeLighting(answers) {
    const { shadow, occlusion } = makeNodes(answers, uniforms);
    const sun = new DirectionalLight(new Color(...kSunIrradiance), 1);
    sun.castShadow = true;
    sun.shadow.shadowNode = shadow;
    const materialOf = (albedo) => {
      const material = new MeshLambertNodeMaterial({ color: new Color(albedo, albedo, albedo) });
      material.aoNode = occlusion;
      return material;
    };
    return { answers, sun, object: materialOf(kAlbedo.object), ground: materialOf(kAlbedo.ground) };
  }
  const lighting = { asset: makeLighting(assetAnswers(object)) };
  let by = null, sun;
  function lightBy(name) {
    if (by) scene.remove(sun, sun.target);
    by = name;
    ({ sun, object: mesh.material, ground: ground.material } = lighting[by]);
    scene.add(sun, sun.target);
    moveSun();
  }
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
    picture.frames = document.body.dataset.frames = 0;
    wake();
  };
  controls.addEventListener('change', change);
  function moveSun() {
    const azimuth = $('azimuth').valueAsNumber * kDegree, elevation = $('elevation').valueAsNumber * kDegree;
    sunDirection.set(Math.cos(elevation) * Math.sin(azimuth), Math.sin(elevation), Math.cos(elevation) * Math.cos(azimuth));
    uniforms.sun.value.copy(sunDirection);
    sun.position.copy(middle).addScaledVector(sunDirection, diagonal);
    sun.target.position.copy(middle);
    change();
  }
  for (const id of ['azimuth', 'elevation']) $(id).addEventListener('input', moveSun);
  lightBy('asset');
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
  $('buffers').textContent = kilobytes(object.words.byteLength);
  $('drawn').textContent = (geometry.index?.count / 3).toLocaleString('en');
  document.body.dataset.loaded = Math.round(performance.now());
  say('');

  // The triangles answer only if they are asked to: their tree takes time to build.
  async function compare() {
    say('Building the tree over the triangles.');
    const { triangleAnswers } = await import('./triangles.js').catch((error) => {
      throw new Error(`three-mesh-bvh cannot be loaded: ${error.message}`);
    });
    const answers = triangleAnswers(geometry.clone(), renderer.backend.device.limits);
    lighting.triangles = makeLighting(answers);
    $('triangles-wire').textContent = '0 kB';
    $('triangles-buffers').textContent = kilobytes(answers.bytes);
    $('triangles-built').textContent = `${answers.milliseconds.toFixed(0)} ms`;
    say('');
  }
  for (const choice of document.querySelectorAll('input[name=by]')) {
    choice.addEventListener('change', async () => {
      $('by').disabled = true;
      try {
        if (!lighting[choice.value]) await compare();
        lightBy(choice.value);
      } catch (error) {
        say(error.message, true);
        document.querySelector('input[value=asset]').checked = true;
      }
      $('by').disabled = false;
    });
  }
  $('by').disabled = false;

  const { queue } = renderer.backend.device, lines = randomRays(kLines, object.bounds), passes = {}, rates = {};
  let asker;
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
    by: () => by,
    byTriangles: async (list) => {
      const pass = new RayPass(renderer, lighting.triangles.answers, new Float32Array(list));
      await pass.run();
      return Array.from(await pass.visible());
    },
  };
  /** Rays a second: the best of three times, of both by turns, because machines do other things as well. */
  async function measure() {
    for (const [name, { answers }] of Object.entries(lighting)) {
      if (!passes[name]) await (passes[name] = new RayPass(renderer, answers, lines)).run();
    }
    for (let turn = 0; turn < 3; ++turn) {
      for (const [name, pass] of Object.entries(passes)) {
        const times = Math.min(64, Math.ceil(30 / (await pass.run()))), milliseconds = await pass.run(times);
        rates[name] = Math.max(rates[name] ?? 0, (times * kLines * 1000) / milliseconds);
        $(name === 'asset' ? 'rate' : 'triangles-rate').textContent = `${(rates[name] / 1e6).toPrecision(2)} million`;
      }
    }
    document.body.dataset.rates = JSON.stringify(rates);
  }
  for (let first = true; ; first = false) {
    if (picture.frames >= kFrames) await new Promise((resolve) => (wake = resolve));
    ++uniforms.frame.value;
    const start = performance.now(), who = by, cell = (name) => $(who === 'asset' ? name : `triangles-${name}`);
    picture.draw(scene, camera);
    await queue.onSubmittedWorkDone();
    const milliseconds = performance.now() - start;
    document.body.dataset.frames = picture.frames;
    cell('frame').textContent = `${milliseconds.toFixed(1)} ms`;
    if (first) {
      document.body.dataset.first = Math.round(performance.now());
      $('first').textContent = `${Math.round(performance.now())} ms`;
      asker = await Asker.create(renderer.backend.device, object);
    } else if (!rates[who]) {
      await measure();
    }
    await new Promise(requestAnimationFrame);
  }
}

main().catch((error) => {
  console.warn(error);
  say(String(error?.message ?? error), true);
});
