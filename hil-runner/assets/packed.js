// Parts that a page carries packed.

/** The bytes of base64. @param {string} base64 */
export function bytesOf(base64) {
  const text = atob(base64.trim());
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  return bytes;
}

/** The bytes of a part as it stands. @param {string} name */
export const carried = (name) => bytesOf(document.querySelector(`script[data-packed="${name}"]`)?.textContent ?? "");

/** A part, unpacked by the browser: gzip. @param {string} name */
export async function unpacked(name) {
  return new Response(new Blob([carried(name)]).stream().pipeThrough(new DecompressionStream("gzip")));
}

/** Lets a script run as an element of the page: the page's policy knows its hash, and of no other. @param {string} text */
export function enter(text) {
  document.head.append(Object.assign(document.createElement("script"), { textContent: text }));
}
