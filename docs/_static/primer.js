// The figure of the primer: the lobes of a coat over a metal, by the formulas that tools/primer.py has recorded.

const { lobes, value } = globalThis.primer;
const RADIANS = Math.PI / 180;
const REACH = 205; // of the longest ray, of the drawing's units
const [X, Y] = [320, 232]; // where light meets the coat
const PLATE = 16; // thickness of the metal that is drawn

// Steps of grey values, in which colours are numbers and conditions 0 or 1
const OPERATIONS = {
  absolute: Math.abs,
  add: (a, b) => a + b,
  both: (a, b) => a && b,
  divide: (a, b) => a / b,
  exp: Math.exp,
  greater: (a, b) => Number(a > b),
  less: (a, b) => Number(a < b),
  maximum: Math.max,
  mean: (a) => a,
  minimum: Math.min,
  multiply: (a, b) => a * b,
  negative: (a) => -a,
  power: (a, b) => a ** b,
  select: (condition, a, b) => (condition ? a : b),
  sqrt: (a) => Math.sqrt(Math.max(a, 0)),
  subtract: (a, b) => a - b,
};

/** The outputs of a tape, by the values of its inputs. */
function run(tape, inputs) {
  const values = [...tape.inputs.map((name) => inputs[name]), ...tape.constants];
  for (const [operation, ...places] of tape.steps) {
    values.push(OPERATIONS[operation](...places.map((place) => values[place])));
  }
  return tape.outputs.map((place) => values[place]);
}

/** What the stack does to light: its lobes by name, and light by solid angle towards an angle of view, of all or one. */
function scattered({ index, coat, depth, metal, angle }) {
  const [sine, cosine] = [Math.sin(angle * RADIANS), Math.cos(angle * RADIANS)];
  const inputs = { 'wi.x': -sine, 'wi.y': 0, 'wi.z': cosine };
  const layers = { 'm.layer0.eta': index, 'm.layer0.alpha_u': coat, 'm.layer1.depth': depth, 'm.layer2.alpha_u': metal };
  const outputs = run(lobes, { ...inputs, ...layers });
  const found = Object.fromEntries(lobes.names.map((name, place) => [name, outputs[place]]));
  const energy = (k) => `l.reflected[${k}].energy`;
  const light = (view, only) => {
    const wo = { 'wo.x': Math.sin(view * RADIANS), 'wo.y': 0, 'wo.z': Math.cos(view * RADIANS) };
    const dark = only === undefined ? {} : { [energy(1 - only)]: 0 };
    return run(value, { ...inputs, ...found, ...dark, ...wo })[0];
  };
  return { energy: [0, 1].map((k) => found[energy(k)]), alpha: [0, 1].map((k) => found[`l.reflected[${k}].alpha_u`]), light };
}

const VIEWS = Array.from({ length: 357 }, (_, k) => (k - 178) / 2); // degrees

const point = (view, length) =>
  `${(X + length * Math.sin(view * RADIANS)).toFixed(2)},${(Y - length * Math.cos(view * RADIANS)).toFixed(2)}`;

/** An interface that is as uneven as it is rough, from left to right. */
function uneven(y, alpha) {
  const height = (x) => y + 14 * alpha * (Math.sin(x / 5) + Math.sin(x / 3.1) + Math.sin(x / 1.9));
  return Array.from({ length: 281 }, (_, k) => `${40 + 2 * k},${height(40 + 2 * k).toFixed(1)}`).join(' ');
}

function draw(figure) {
  const part = (name) => figure.querySelector(`.${name}`);
  const sliders = [...figure.querySelectorAll('input')];
  const given = Object.fromEntries(sliders.map((slider) => [slider.name, Number(slider.value)]));
  const { energy, alpha, light } = scattered(given);

  // Lobes: the length of a ray is the root of the light, so that faint lobes are seen beside bright ones
  const rays = VIEWS.map((view) => [light(view), light(view, 0), light(view, 1)]);
  const longest = Math.sqrt(Math.max(...rays.map(([all]) => all)));
  ['all', 'of-coat', 'of-metal'].forEach((name, k) => {
    const points = VIEWS.map((view, n) => point(view, (REACH * Math.sqrt(rays[n][k])) / longest));
    part(name).setAttribute('points', `${X},${Y} ${points.join(' ')}`);
  });

  // Layers, and the path of light through them
  const below = 30 + 32 * given.depth;
  const inside = Math.asin(Math.sin(given.angle * RADIANS) / given.index);
  const across = below * Math.tan(inside);
  part('coat').setAttribute('points', uneven(Y, given.coat));
  part('metal').setAttribute('points', `${uneven(Y + below, given.metal)} 600,${Y + below + PLATE} 40,${Y + below + PLATE}`);
  part('medium').setAttribute('height', below + PLATE);
  part('medium').setAttribute('fill-opacity', 0.06 + 0.2 * given.depth);
  part('arriving').setAttribute('points', `${point(-given.angle, REACH + 15)} ${X},${Y}`);
  const ways = [[X, Y], [X + across, Y + below], [X + 2 * across, Y]];
  part('way').setAttribute('points', ways.map(([x, y]) => `${x.toFixed(1)},${y.toFixed(1)}`).join(' '));

  // Numbers
  const percent = (share) => `${(100 * share).toFixed(1)} %`;
  const write = (name, text) => (part(name).textContent = text);
  ['coat', 'metal'].forEach((name, k) => {
    write(`${name}-energy`, percent(energy[k]));
    write(`${name}-alpha`, alpha[k].toFixed(3));
  });
  write('lost', percent(1 - energy[0] - energy[1]));
  for (const slider of sliders) {
    const text = slider.name === 'angle' ? `${slider.value}°` : Number(slider.value).toFixed(2);
    slider.setAttribute('aria-valuetext', text);
    slider.parentElement.querySelector('span').textContent = text;
  }
  part('drawing').setAttribute(
    'aria-label',
    `Polar diagram above two layers: the coat reflects ${percent(energy[0])} of the light, ` +
      `the metal ${percent(energy[1])}, with roughness ${alpha[1].toFixed(2)}.`,
  );
}

for (const figure of document.querySelectorAll('.primer')) {
  figure.addEventListener('input', () => draw(figure));
  draw(figure);
}
