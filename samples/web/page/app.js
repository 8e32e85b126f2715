// The page: an object, a sun, and two engines that answer its rays.
import { compare } from './compare.js';
import { Engine } from './engine.js';
import { areAlike, listen, sorted } from './files.js';
import { SunHandle } from './handle.js';
import { listenToKeys } from './keys.js';
import { groundOf, kLight, Sun } from './light.js';
import { Lighting } from './lighting.js';
import { Picture } from './picture.js';
import { simd, started, workers } from './start.js';
import { bytes, showDifference, showEngine, showRate } from './table.js';
import { View } from './view.js';

const kMostPixels = 400000; // of the traced picture
const kinds = ['asset', 'triangles'];

const element = (id) => document.getElementById(id);
const stage = element('stage'), message = element('message'), progress = element('progress'), loadTriangles = element('triangles');
const radios = Object.fromEntries(kinds.map((kind) => [kind, document.querySelector(`input[value=${kind}]`)]));

/** The available engines { asset, triangles } of the same object, one of which lights the picture. */
const engines = {};
let lit;

function say(text, isWrong = false) {
  message.textContent = text;
  message.classList.toggle('wrong', isWrong);
}
const sentence = (error) => {
  const text = String(error?.message ?? error);
  return text.endsWith('.') ? text : `${text}.`;
};

const sun = new Sun();
let picture, view, handle, lighting;
let size = [1, 1];

function makeView(scale) {
  const [width, height] = size.map((pixels) => Math.max(1, Math.round(pixels / scale)));
  const { sunAngle: angle, albedo } = kLight;
  return { width, height, camera: view.traced(), ground: groundOf(engines[lit].info), sun: { direction: sun.direction, angle }, albedo };
}

/** Restarts the picture after something moved. */
function change() {
  if (!lit) return;
  document.body.dataset.samples = 0;
  handle.place();
  lighting.change(engines[lit]);
}

function show(sums, { width, height }, samples, goal) {
  picture.show(sums, width, height);
  progress.value = samples / goal;
  progress.hidden = samples === goal;
  document.body.dataset.samples = samples;
  document.body.dataset.pictures = 1 + Number(document.body.dataset.pictures ?? 0);
  if (document.body.dataset.interactive) return;
  // Listeners are set up, and this is the first picture.
  const milliseconds = Math.round(performance.now());
  document.body.dataset.interactive = milliseconds;
  element('interactive').textContent = `The first picture appeared ${milliseconds} ms after the page was requested.`;
}

function lightBy(kind) {
  lit = kind;
  radios[kind].checked = true;
  change();
  measure();
}

let measuring = 0;
/** Measures the rows of the table, once the picture is complete enough. */
async function measure() {
  const number = ++measuring;
  const { asset, triangles } = engines;
  try {
    const result = await lighting.between(() => number === measuring && compare(engines, engines[lit], makeView(1)));
    if (!result || number !== measuring || asset !== engines.asset || triangles !== engines.triangles) return;
    for (const [kind, rate] of Object.entries(result.rates)) showRate(kind, rate);
    if (result.different !== undefined) showDifference(result.different, result.rays);
    document.body.dataset.measured = JSON.stringify(result);
  } catch (error) {
    if (number === measuring) say(sentence(error), true);
  }
}

function sayWhat(names) {
  const isOurs = kinds.every((kind) => !engines[kind]?.source.file);
  element('credit').hidden = !isOurs;
  const what = isOurs ? 'Drop a .nif, a .glb or both here to see your own.' : `Showing ${names.join(' and ')}.`;
  say([what, engines.asset?.info.note].filter(Boolean).join(' '));
}

/** New engines replace those of their kind; the other one stays if it has the same object. */
function take(opened) {
  const before = { ...engines };
  for (const kind of kinds) {
    const stays = engines[kind] && !opened[kind] && Object.values(opened).every((other) => areAlike(other, engines[kind]));
    if (!stays) engines[kind] = opened[kind];
    if (before[kind] && before[kind] !== engines[kind]) before[kind].close();
    showEngine(kind, engines[kind]);
    radios[kind].disabled = !engines[kind];
  }
  delete document.body.dataset.measured;
  const isOther = !lit || !Object.values(before).some((engine) => engine && Object.values(opened).some((other) => areAlike(other, engine)));
  if (!engines[lit]) lit = kinds.find((kind) => engines[kind]);
  if (isOther) view.reset(engines[lit].info);
  lightBy(lit);
}

let opening = Promise.resolve();
/** Opens sources { asset, triangles } one after the other; if one cannot be opened, everything stays as it was. */
function open(sources) {
  opening = opening.then(async () => {
    const names = Object.values(sources).map(({ file, url }) => file?.name ?? url);
    const opened = {};
    say(`Loading ${names.join(' and ')}.`);
    try {
      for (const [kind, source] of Object.entries(sources)) opened[kind] = await Engine.open(kind, source, kind === 'asset' ? { workers, simd } : {});
      if (opened.asset && opened.triangles && !areAlike(opened.asset, opened.triangles))
        throw new Error(`${names.join(' and ')} are different objects: their sizes or places differ`);
      take(opened);
      loadTriangles.hidden = true;
      sayWhat(names);
    } catch (error) {
      for (const engine of Object.values(opened)) engine.close();
      say(sentence(error), true);
    }
  });
  return opening;
}

function openFiles(files) {
  try {
    const sources = Object.fromEntries(Object.entries(sorted(files)).map(([kind, file]) => [kind, { file }]));
    return open(sources);
  } catch (error) {
    return say(sentence(error), true);
  }
}

function resize() {
  const { width, height } = stage.getBoundingClientRect();
  if (width < 1 || height < 1) return;
  const scale = Math.min(devicePixelRatio, Math.sqrt(kMostPixels / (width * height)));
  size = [width, height].map((pixels) => Math.max(1, Math.round(scale * pixels)));
  view.resize(...size);
  picture.resize(...size);
  change();
}

async function begin() {
  const canvas = element('canvas');
  picture = new Picture(canvas);
  view = new View(canvas, change);
  handle = new SunHandle(element('sun'), stage, view, sun, change);
  lighting = new Lighting({ makeView, onShow: show, onError: (error) => say(sentence(error), true) });
  new ResizeObserver(resize).observe(stage);
  canvas.addEventListener('webglcontextlost', () => say('The browser has taken the graphics away. Reload the page.', true));
  for (const kind of kinds) radios[kind].addEventListener('change', () => lightBy(kind));
  const reset = () => {
    sun.reset();
    if (lit) view.reset();
    change();
  };
  const toggle = () => {
    const other = kinds.find((kind) => kind !== lit && engines[kind]);
    if (other) lightBy(other);
  };
  const choose = element('choose');
  listenToKeys({
    sun: (azimuth, elevation) => (sun.move(azimuth, elevation), change()),
    turn: (...by) => lit && view.turn(...by),
    toggle,
    open: () => choose.click(),
    reset,
  });
  listen({ hint: element('drop'), choose, input: element('files') }, openFiles);
  resize();
  const asset = await started;
  take({ asset });
  sayWhat([]);
  const { triangles: url, triangleBytes } = document.body.dataset;
  if (!url) return;
  loadTriangles.textContent = `Load the triangles, ${bytes(Number(triangleBytes))}`;
  // They are large, so users with limited data ask for them.
  loadTriangles.addEventListener('click', () => {
    loadTriangles.hidden = true;
    if (engines.asset !== asset) return; // the user has opened another object meanwhile
    open({ triangles: { url } });
  });
  const isSmall = matchMedia('(max-width: 800px)').matches || navigator.connection?.saveData;
  if (isSmall) loadTriangles.hidden = false;
  else lighting.between(() => {}).then(() => loadTriangles.click());
}

/** For tests and the console: the parameters with which nif render makes the same picture. */
globalThis.sample = {
  picture: () => ({ size, camera: view.traced(), target: view.middle.toArray(), sun: sun.direction, light: kLight }),
  openFiles,
};

begin().catch((error) => say(sentence(error), true));
