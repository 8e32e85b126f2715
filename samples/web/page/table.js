// The table with the costs of both engines.

const kColumns = { asset: 0, triangles: 1 };
const cell = (row, kind) => document.querySelector(`#${row}`).cells[1 + (kColumns[kind] ?? 0)];

/** A number of bytes for people. */
export const bytes = (count) =>
  count < 1e6 ? `${(count / 1e3).toFixed(count < 1e5 ? 1 : 0)} kB` : `${(count / 1e6).toFixed(count < 1e8 ? 1 : 0)} MB`;

/** The costs of an engine; undefined: there is none. */
export function showEngine(kind, engine) {
  const info = engine?.info;
  cell('file', kind).textContent = info ? bytes(info.fileBytes) : '–';
  cell('memory', kind).textContent = info ? bytes(info.memoryBytes) : '–';
  cell('ready', kind).textContent = info ? `${Math.round(info.milliseconds)} ms` : '–';
  if (info) return;
  cell('rate', kind).textContent = '–';
  cell('differ').textContent = '–';
}

export function showRate(kind, raysASecond) {
  cell('rate', kind).textContent = (raysASecond / 1e6).toFixed(2);
}

export function showDifference(different, rays) {
  cell('differ').textContent = `${((100 * different) / rays).toFixed(2)} % of ${rays.toLocaleString('en')} rays`;
}
