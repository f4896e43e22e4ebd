'use strict';
// meshes.js: the glTFs that the page holds, or that lie beside it.

const meshKinds = ['mechanical', 'geometric'];
const partsOf = kind => [...document.querySelectorAll(`script[data-mesh="${kind}"]`)];

function bytesOf(base64) {
  const text = atob(base64), bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  return bytes;
}

// The parts are let go as they are unpacked.
function unpack(parts) {
  const stream = new ReadableStream({
    pull(to) {
      const part = parts.shift();
      if (!part) return to.close();
      to.enqueue(bytesOf(part.textContent.trim()));
      part.remove();
    },
  });
  return new Response(stream.pipeThrough(new DecompressionStream('gzip'))).arrayBuffer();
}

async function fetchMesh(name) {
  const answer = await fetch(encodeURIComponent(name));
  if (!answer.ok) throw new Error(`${name}: ${answer.status}`);
  return answer.arrayBuffer();
}

// Bytes of a mesh, or null where the page has none.
async function loadMesh(kind) {
  const parts = partsOf(kind).filter(p => !('missing' in p.dataset));
  if (!parts.length) return null;
  return parts[0].dataset.link ? fetchMesh(parts[0].dataset.link) : unpack(parts);
}

// Why a mesh is not in the page, as the program says it.
const missingMeshes = () => meshKinds.flatMap(partsOf).map(p => p.dataset.missing).filter(Boolean);
