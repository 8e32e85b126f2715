// What differs between pages and node: reading files, and workers.
import { NifError, refuse } from './errors.js';

export const isNode = typeof process === 'object' && typeof process.versions?.node === 'string' && typeof document === 'undefined';

/** Imports a module of node; bundlers for pages must leave it alone. */
const ofNode = (name) => import(/* webpackIgnore: true */ /* @vite-ignore */ `node:${name}`);

async function readLocal(url, signal) {
  const { readFile } = await ofNode('fs/promises');
  try {
    return await readFile(url, { signal });
  } catch (error) {
    signal?.throwIfAborted();
    const missing = error.code === 'ENOENT' || error.code === 'ENOTDIR';
    if (missing) refuse(`${url}: there is no such file`, 'FILE_NOT_FOUND');
    refuse(`${url}: cannot be read: ${error.message}`, 'FILE_UNREADABLE');
  }
}

/** A Response, or in node the bytes of a local file. `url`: a URL, or a text; in node that may be a path. */
export async function open(url, signal) {
  if (isNode) {
    if (url instanceof URL ? url.protocol === 'file:' : !/^[a-z][a-z+.-]+:/i.test(url)) return readLocal(url, signal);
    if (String(url).startsWith('file:')) return readLocal(new URL(url), signal);
  }
  let response;
  try {
    response = await fetch(url, { credentials: 'same-origin', signal });
  } catch (error) {
    signal?.throwIfAborted();
    refuse(`${url}: cannot be read: ${error.message}`, 'FILE_UNREADABLE');
  }
  if (response.status === 404 || response.status === 410) refuse(`${url}: there is no such file (HTTP ${response.status})`, 'FILE_NOT_FOUND');
  if (!response.ok) refuse(`${url}: cannot be read: HTTP ${response.status}`, 'FILE_UNREADABLE');
  return response;
}

/** All bytes of what open() returned. */
export async function bytesOf(opened, name, signal) {
  if (opened instanceof Uint8Array) return opened;
  try {
    return new Uint8Array(await opened.arrayBuffer());
  } catch (error) {
    signal?.throwIfAborted();
    if (error instanceof NifError) throw error;
    refuse(`${name}: cannot be read: ${error.message}`, 'FILE_UNREADABLE');
  }
}

/** A worker that runs a script of this package: post(message, transfer), onMessage, onError, stop(). */
export async function startWorker(url) {
  if (isNode) {
    const { Worker } = await ofNode('worker_threads');
    const worker = new Worker(url);
    return {
      post: (message, transfer) => worker.postMessage(message, transfer),
      listen(onMessage, onError) {
        worker.on('message', onMessage);
        worker.on('error', onError);
      },
      stop: () => worker.terminate(),
    };
  }
  const worker = new Worker(url, { type: 'module' });
  return {
    post: (message, transfer) => worker.postMessage(message, transfer),
    listen(onMessage, onError) {
      worker.onmessage = (event) => onMessage(event.data);
      worker.onerror = (event) => onError(new Error(event.message || 'the worker could not be started'));
    },
    stop: () => worker.terminate(),
  };
}

/** In a worker: how it receives messages and answers. */
export async function ownPort() {
  if (!isNode) return self;
  const { parentPort } = await ofNode('worker_threads');
  return {
    postMessage: (message, transfer) => parentPort.postMessage(message, transfer),
    set onmessage(hear) {
      parentPort.on('message', (data) => hear({ data }));
    },
  };
}
