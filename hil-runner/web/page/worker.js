// The simulator in its worker: a request in, the bytes of its answer out.
"use strict";

/** @type {any} the image's functions */
let image;

const scope = /** @type {any} */ (self);

/** The answer of an image. @param {any} image @param {string} method @param {Uint8Array} request @returns {ArrayBuffer} */
function answered(image, method, request) {
  // Room may move the memory: its buffer is asked for afterwards.
  const room = image.room(request.length);
  new Uint8Array(image.memory.buffer, room, request.length).set(request);
  const length = image[method]();
  const start = image.answer();
  return image.memory.buffer.slice(start, start + length);
}

scope.onmessage = async (/** @type {MessageEvent} */ { data: { unpacker, packed, module, id, method, request } }) => {
  try {
    if (method) {
      const answer = answered(image, method, new TextEncoder().encode(request));
      return scope.postMessage({ id, answer }, [answer]);
    }
    if (packed) {
      const { instance } = await WebAssembly.instantiate(unpacker);
      module = await WebAssembly.compile(answered(instance.exports, "unpack", packed));
    }
    image = (await WebAssembly.instantiate(/** @type {WebAssembly.Module} */ (module), {})).exports;
    scope.postMessage({ module });
  } catch (error) {
    scope.postMessage({ id, failed: String(error) });
  }
};
