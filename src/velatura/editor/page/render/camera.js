// The camera: the rays and the projection that follow from it, and orbits by mouse, touch and keys.

import { Matrix4, Spherical, Vector3 } from 'three';

const TURN = 0.005; // radians a pixel
const STEP = 0.1; // radians, or share of the distance, a key
const STILL = 4; // pixels that a hand may move while it clicks
const POLE = 0.01; // radians that are kept from it

/** Uniforms of a camera {origin, target, fov in degrees over the shorter side} for a picture. */
export function cameraUniforms({ origin, target, fov }, width, height) {
  const [eye, centre] = [new Vector3(...origin), new Vector3(...target)];
  const ahead = centre.clone().sub(eye).normalize();
  const right = ahead
    .clone()
    .cross(new Vector3(0, 1, 0))
    .normalize();
  const up = right.clone().cross(ahead);
  const half = Math.tan((fov * Math.PI) / 360) / Math.min(width, height);
  const [across, along] = [half * width, half * height];
  const distance = eye.distanceTo(centre);
  const [near, far] = [0.02 * distance, 200 * distance];
  const projection = new Matrix4()
    .makePerspective(-near * across, near * across, near * along, -near * along, near, far)
    .multiply(new Matrix4().makeBasis(right, up, ahead.clone().negate()).setPosition(eye).invert());
  return {
    camera_origin: origin,
    camera_axes: [...right.multiplyScalar(across), ...up.multiplyScalar(along), ...ahead],
    camera_projection: projection.elements,
    picture_size: [width, height],
  };
}

/** The direction, of length 1, from which light comes to a camera at a place of a picture, in pixels from the lower left. */
export function rayOf({ camera_axes: axes, picture_size: [width, height] }, x, y) {
  const [right, up, ahead] = [0, 3, 6].map((k) => new Vector3().fromArray(axes, k));
  return ahead.addScaledVector(right, (2 * x) / width - 1).addScaledVector(up, (2 * y) / height - 1).normalize();
}

/** Moves a camera about its target: by so many radians, and to so many times its distance. */
export function orbited({ origin, target, fov }, azimuth, elevation, distance = 1) {
  const from = new Vector3(...origin).sub(new Vector3(...target));
  const place = new Spherical().setFromVector3(from);
  place.theta += azimuth;
  place.phi = Math.min(Math.max(place.phi + elevation, POLE), Math.PI - POLE);
  place.radius *= distance;
  return {
    origin: new Vector3()
      .setFromSpherical(place)
      .add(new Vector3(...target))
      .toArray(),
    target,
    fov,
  };
}

/**
 * Calls `move(azimuth, elevation, distance)` for what hands do on a canvas, with Shift `turn(azimuth)` of the light, and `begin` and
 * `end` around it; `tap(x, y)`, of the canvas on the page, where they have not moved.
 */
export function listen(canvas, { move, turn, begin, end, tap }, signal) {
  const on = (name, act) => canvas.addEventListener(name, act, { signal, passive: false });
  const fingers = new Map();
  let way = 0; // pixels since the first finger came
  const spread = () => {
    const [a, b] = fingers.values();
    return Math.hypot(a.x - b.x, a.y - b.y);
  };
  canvas.tabIndex = Math.max(canvas.tabIndex, 0);
  canvas.style.touchAction = 'none';
  on('pointerdown', (event) => {
    if (event.button !== 0) return;
    canvas.setPointerCapture(event.pointerId);
    if (fingers.size === 0) way = 0;
    fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    begin();
  });
  on('pointermove', (event) => {
    const before = fingers.get(event.pointerId);
    if (!before) return;
    const apart = fingers.size === 2 ? spread() : 0;
    way += Math.hypot(event.clientX - before.x, event.clientY - before.y);
    fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (fingers.size === 1 && event.shiftKey) turn(TURN * (event.clientX - before.x));
    else if (fingers.size === 1) move(TURN * (before.x - event.clientX), TURN * (before.y - event.clientY), 1);
    else if (fingers.size === 2) move(0, 0, apart / Math.max(spread(), 1));
  });
  const leave = (event) => {
    if (!fingers.delete(event.pointerId) || fingers.size > 0) return;
    end();
    if (event.type === 'pointerup' && way < STILL) tap(event.offsetX, event.offsetY);
  };
  on('pointerup', leave);
  on('pointercancel', leave);
  on('wheel', (event) => {
    event.preventDefault();
    move(0, 0, Math.exp(Math.min(Math.max(event.deltaY, -100), 100) * 0.001));
  });
  on('keydown', (event) => {
    const step = KEYS[event.key];
    if (!step || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    if (event.shiftKey && step[0]) turn(step[0]);
    else move(...step);
  });
}

const KEYS = {
  ArrowLeft: [-STEP, 0, 1],
  ArrowRight: [STEP, 0, 1],
  ArrowUp: [0, -STEP, 1],
  ArrowDown: [0, STEP, 1],
  '+': [0, 0, 1 - STEP],
  '=': [0, 0, 1 - STEP],
  '-': [0, 0, 1 + STEP],
};
