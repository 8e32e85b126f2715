// The error class of this package, and checks of arguments that throw it.

/** Numbers of nif.h that this package itself uses; they never change. */
const codes = {
  INVALID_ARGUMENT: 2,
  INVALID_OPERATION: 3,
  NOT_AVAILABLE: 5,
  OUT_OF_MEMORY: 4,
  FILE_NOT_FOUND: 10,
  FILE_UNREADABLE: 11,
  DAMAGED_NIF: 32,
};

export class NifError extends Error {
  constructor(code, codeName, message) {
    super(message);
    this.name = 'NifError';
    this.code = code;
    this.codeName = codeName;
  }
}

/** An error of this package's own. */
export const failure = (message, name = 'INVALID_ARGUMENT') => new NifError(codes[name], `NIF_ERROR_${name}`, message);

/** Throws one. */
export function refuse(message, name) {
  throw failure(message, name);
}

/** Checks that `value` is an integer from 0 to `most`, and returns it. */
export function wholeNumber(value, name, most = 0xffffffff) {
  if (!Number.isInteger(value) || value < 0 || value > most) refuse(`${name} is ${String(value)}, not a whole number from 0 to ${most}`);
  return value;
}

/** A typed array of this class whose buffer is there. */
export function typedArray(value, Type, name) {
  if (!(value instanceof Type)) refuse(`${name} is no ${Type.name}`);
  bytesIn(value, name);
  return value;
}

/** Checks that `signal` is undefined or an AbortSignal. Throws its reason if it is already aborted. */
export function readSignal(signal) {
  if (signal !== undefined && !(signal instanceof AbortSignal)) refuse('signal is no AbortSignal');
  signal?.throwIfAborted();
  return signal;
}

/** The bytes of a buffer or a view. Refuses one whose memory is gone, which would otherwise count as empty. */
export function bytesIn(source, name) {
  try {
    source.keys?.(); // throws also where a buffer has become too small for its typed array
    return new Uint8Array(source.buffer ?? source, source.byteOffset, source.byteLength);
  } catch {
    return refuse(`the buffer of ${name} is detached or too small: it was given to a worker or resized, or its memory has grown`);
  }
}
