// A material in an address: after #m= its JSON, deflated, in base64url.

import { areLights } from './lights.js';

const MARK = '#m=';
const MOST = 2 ** 18; // bytes of the JSON, as many as Python takes of a material's text
const VIEW = { object: 'objects', environment: 'environments', rotation: null, exposure: null, transform: 'views' }; // what is shared of it

/** What follows the address of the page to open it with what is shown now; files that were dropped are left out. */
export async function fragmentOf(state, material) {
  const { model, switches, view, camera } = state;
  const shown = Object.fromEntries(
    Object.keys(VIEW).flatMap((key) => (String(view[key]).startsWith('file:') ? [] : [[key, view[key]]])),
  );
  const text = JSON.stringify({ material, model, switches, view: { ...shown, lights: view.lights }, camera });
  const bytes = await through(new CompressionStream('deflate-raw'), new TextEncoder().encode(text));
  const letters = btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(''));
  return MARK + letters.replace(/\+/g, '-').replace(/\//g, '_').replace(/=+$/, '');
}

export const isShared = (fragment) => fragment.startsWith(MARK);

/**
 * {material, model, switches, view, camera} of a fragment; the material is not checked yet. Raises Error in words.
 */
export async function readFragment(fragment, session) {
  let found;
  try {
    const letters = atob(fragment.slice(MARK.length).replace(/-/g, '+').replace(/_/g, '/'));
    const bytes = Uint8Array.from(letters, (letter) => letter.charCodeAt(0));
    found = JSON.parse(new TextDecoder().decode(await through(new DecompressionStream('deflate-raw'), bytes, MOST)));
  } catch {
    throw new Error('The address holds no material that can be read: it has been cut off, or changed.');
  }
  const { material, model, switches, view, camera = null } = Object(found);
  const named = session.models.find(({ name }) => name === model);
  if (!named) throw new Error(`The address names a model that is not known here: ${show(model)}.`);
  const chosen = Object.entries(Object(switches));
  const wrong = chosen.find(([key, value]) => !Object.hasOwn(named.switches, key) || !named.switches[key].includes(value));
  if (wrong) throw new Error(`The address has a switch that ${model} does not take: ${show(wrong[0])}.`);
  return {
    ...{ material, model, switches: Object.fromEntries(chosen), view: known(Object(view), session) },
    camera: isCamera(camera) ? camera : null,
  };
}

const show = (value) => String(typeof value === 'string' ? value : JSON.stringify(value)).slice(0, 40);

/** Of a view that which is possible here. */
function known(view, session) {
  const possible = ([key, list]) => {
    if (!list) return Number.isFinite(view[key]);
    return session[list].some((entry) => (entry.name ?? entry) === view[key]);
  };
  const named = Object.fromEntries(Object.entries(VIEW).filter(possible).map(([key]) => [key, view[key]]));
  return areLights(view.lights) ? { ...named, lights: view.lights } : named;
}

const isPoint = (point) => Array.isArray(point) && point.length === 3 && point.every(Number.isFinite);
const isCamera = (camera) => isPoint(camera?.origin) && isPoint(camera.target) && Number.isFinite(camera.fov);

/** Bytes after a stream that transforms them; RangeError where these are more than `most`. */
export async function through(stream, bytes, most = Infinity) {
  let left = most;
  const counted = new TransformStream({
    transform(chunk, out) {
      left -= chunk.length;
      if (left < 0) throw new RangeError(`more than ${most} bytes`);
      out.enqueue(chunk);
    },
  });
  const transformed = new Blob([bytes]).stream().pipeThrough(stream).pipeThrough(counted);
  return new Uint8Array(await new Response(transformed).arrayBuffer());
}
