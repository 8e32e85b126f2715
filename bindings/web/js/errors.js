// What nifkit refuses.

/** Numbers of nif.h that this package itself uses; they never change. */
export const Code = {
  INVALID_ARGUMENT: 2,
  NOT_AVAILABLE: 5,
  OUT_OF_MEMORY: 4,
  FILE_NOT_FOUND: 10,
  FILE_UNREADABLE: 11,
};

export class NifError extends Error {
  constructor(code, codeName, message) {
    super(message);
    this.name = 'NifError';
    this.code = code;
    this.codeName = codeName;
  }
}

const nameOf = new Map(Object.entries(Code).map(([name, code]) => [code, `NIF_ERROR_${name}`]));

/** Throws an error of this package's own. */
export function refuse(message, code = Code.INVALID_ARGUMENT) {
  throw new NifError(code, nameOf.get(code), message);
}

/** `value` as a whole number from 0 to `most`. */
export function wholeNumber(value, name, most = 0xffffffff) {
  if (!Number.isInteger(value) || value < 0 || value > most) refuse(`${name} is ${String(value)}, not a whole number from 0 to ${most}`);
  return value;
}

/** A typed array of this class whose buffer is there. */
export function typedArray(value, Type, name) {
  if (!(value instanceof Type)) refuse(`${name} is no ${Type.name}`);
  if (isDetached(value.buffer)) refuse(`the buffer of ${name} is detached: it was given to a worker, or its memory has grown`);
  return value;
}

export function isDetached(buffer) {
  if (buffer.byteLength > 0) return false;
  try {
    new Uint8Array(buffer);
    return false;
  } catch {
    return true;
  }
}
