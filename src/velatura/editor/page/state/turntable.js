// Frames of a turntable: the view after a share of a full turn.

/** The ways of turning, with their titles. */
export const TURNS = [
  ['object', 'The object turns'],
  ['light', 'The light turns'],
  ['camera', 'The camera turns'],
];

/** The `camera` and the `rotation` of the light, in degrees, after a share of a turn, anticlockwise seen from above. */
export function turned({ camera, rotation }, what, share) {
  const angle = 360 * share;
  if (what === 'light') return { camera, rotation: rotation + angle };
  if (what === 'camera') return { camera: about(camera, angle), rotation };
  return { camera: about(camera, -angle), rotation: rotation - angle }; // all but the object, the other way round
}

/** A camera turned about the y axis by degrees. */
function about(camera, degrees) {
  const angle = (degrees * Math.PI) / 180, [cos, sin] = [Math.cos(angle), Math.sin(angle)];
  const around = ([x, y, z]) => [cos * x + sin * z, y, cos * z - sin * x];
  return { ...camera, origin: around(camera.origin), target: around(camera.target) };
}

/** Names of so many frames, which follow one another; `taken` are names that no frame may begin like. */
export function frameNames(stem, ending, count, taken) {
  const free = [stem, ...taken.map((_, i) => `${stem}-${i + 2}`)].find((start) => !taken.some((name) => name.startsWith(`${start}-0`)));
  const digits = String(count).length + 1;
  return Array.from({ length: count }, (_, k) => `${free}-${String(k + 1).padStart(digits, '0')}.${ending}`);
}
