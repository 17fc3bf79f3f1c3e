// The material by its lobes: handles to drag, and the stack that has them.

import { html, nothing, render } from 'lit-html';
import { Recent } from '../recent.js';
import { addCoat, setAppearance, setView } from '../state/commands.js';
import { chosenPart, documentOf, stackOf } from '../state/material.js';
import './appearance.css';
import { createClass } from './appearance/class.js';
import { described, handles } from './appearance/handles.js';
import { about, axesOf, blurOf, changed, hue, withBlur, withMean } from './appearance/looks.js';
import { asker, oneAtATime } from './appearance/questions.js';
import { createWishes } from './appearance/wishes.js';
import { createWorkshop } from './appearance/workshop.js';
import { colourRow, hex } from './colour.js';
import { capital, dial, iconButton, menu, number, styles } from './controls.js';
import { mean, shown } from './plots/scale.js';
import { line } from './settings.js';

const KEPT = 60; // materials whose targets are known
const ENERGIES = [-4, 0]; // decades of a slider
const SHARE = { low: 0, high: 1, strict: false };
const COAT = { eta: 1.5, alpha: 0, keep: true };
const BASES = [
  ['dielectric', 'Dielectric'],
  ['conductor', 'Conductor'],
  ['mirror', 'Mirror'],
];

/**
 * Shows the panel in an element; it follows the store.
 *
 * @param {HTMLElement} element
 * @param {{store, session, call, live, viewport, edits, messages, picture, isQuiet: function}} services `isQuiet()` is
 *   whether Python has answered all
 * @returns {{know: function, destroy: function}}
 */
export function mountAppearance(element, services) {
  const { store, session, call, live, edits, messages } = services;
  const ask = asker({ live, call });
  const known = new Recent(KEPT); // answers, by material
  let read = { target: null, haze: [], says: 'The lobes are being read.' };
  let text = ''; // of the material that was read, or is asked about
  let asked = null; // target that was wished for, where it could not be had, or not yet
  let refused = null; // why it could not: {lobe, text}
  let held = false;
  let rough = null; // wish whose answer is approximate
  let origin = null; // material that the wishes of a step start from
  let ways = null; // ways out of the wish that could not be had: {words, target}
  let chosen = 0;
  let unlocked = null; // the lobe whose axes are shown though they are alike
  let coat = COAT;
  let coatLobe = null; // of the last coat itself
  let coatSays = '';
  let frame = 0;
  let reading = 0; // questions about a material that are not answered yet

  // Known targets of materials

  const textOf = ({ layers, exterior = 1, thin = false }, { model, switches }) =>
    JSON.stringify([layers, exterior, thin, model, switches]);
  const now = () => textOf(stackOf(store.get()), store.get());
  const question = () => {
    const { model, switches } = store.get();
    return { material: stackOf(store.get()), model, switches };
  };

  /** Reads the material anew where it is another one. */
  async function follow() {
    const isSeen = !element.hidden && element.checkVisibility(); // which lays out the page
    if (isSeen) further.follow();
    if (!isSeen || now() === text) return paint();
    text = now();
    [asked, origin, ways, coatLobe, coatSays] = [null, null, null, null, ''];
    const key = text;
    reading++;
    try {
      const answer = known.get(key) ?? (await ask('appearance', question()));
      if (!answer || key !== text) return;
      known.set(key, answer);
      show(answer);
    } catch (error) {
      if (key !== text) return;
      text = '';
      show({ target: null, haze: [], says: error.message });
    } finally {
      reading--;
    }
  }

  function show(answer) {
    read = answer;
    refused = answer.snapped ? about(answer.snapped) : null;
    chosen = Math.min(chosen, (read.target?.lobes.length ?? 1) - 1);
    classes.follow();
    paint();
  }

  // Wishes: one is asked for at a time; lobes are wished for from the material that the step began with, so that the
  // answer depends on the wish alone, and not on the way of the hand

  const wishes = oneAtATime(async (wish) => {
    const { verb, body, command } = wish;
    const before = now();
    try {
      // While it is held, an answer may be approximate: from the lobes that the material is known to have
      const known = held && read.target ? { read: read.target } : {};
      const whole = { ...question(), ...body, ...known };
      const answer = (await ask(verb, whole)) ?? (held ? null : await call(verb, whole)); // what rests is answered
      if (!answer || before !== now()) return;
      rough = answer.rough ? wish : null;
      accept(answer, command);
      messages.forgive('appearance');
    } catch (error) {
      messages.fail('appearance', error);
    }
  }, () => held || comeToRest());

  function accept({ material, target, haze, held: holds, snapped, why }, command) {
    [refused, ways] = [snapped || why ? about(snapped ?? why) : null, null];
    if (!material) return paint();
    read = { target, haze, held: holds, snapped, says: null };
    text = textOf(material, store.get());
    known.set(text, read);
    if (text !== now()) edits.drag('appearance', command, material); // what is refused is no step
    paint();
  }

  function want(wish) {
    held = true;
    wishes.want(wish);
  }

  /** Ends a step once the last wish is answered. */
  function letGo() {
    held = false;
    if (!wishes.busy) comeToRest();
  }

  /** Asks again for what was answered approximately; then ends the step. */
  function comeToRest() {
    if (!rough) return settle();
    const wish = rough;
    rough = null;
    wishes.want(wish);
  }

  function settle() {
    if (refused && asked && origin) findWays();
    if (!refused) asked = null;
    origin = null;
    edits.settle();
    classes.follow();
    paint();
  }

  /** Requests changes of a lobe; earlier requests of the same drag remain. */
  function wish(index, changes) {
    chosen = index;
    origin ??= documentOf(store.get());
    asked = changed(underHand(), index, changes);
    want({ verb: 'invert', body: { target: asked, material: origin }, command: setAppearance });
    paint();
  }

  /** Asks for ways out of a wish that was refused. */
  async function findWays() {
    const wish = asked;
    const { model, switches } = store.get();
    try {
      const answer = await call('ways', { target: wish, model, switches });
      if (answer && wish === asked) ways = answer.ways;
      paint();
    } catch (error) {
      messages.fail('appearance', error);
    }
  }

  /** Takes a way out, as one step. */
  function take({ target }) {
    const { start, ...wished } = target;
    asked = null;
    want({ verb: 'invert', body: { target: wished, material: start }, command: setAppearance });
    letGo();
  }

  const once = (index, changes) => {
    wish(index, changes);
    letGo();
  };

  const classes = createClass(services, {
    ask,
    question,
    want,
    letGo,
    paint,
    target: () => (read.says ? null : read.target),
    chosen: () => chosen,
    held: () => held || wishes.busy,
  });

  const further = createWishes(services, { ask, question, paint });
  const workshop = createWorkshop(services, { question, paint });

  function choose(index) {
    if (index === chosen) return;
    [chosen, unlocked] = [index, null];
    classes.follow();
    paint();
  }

  // The panel

  function paint() {
    frame ||= requestAnimationFrame(() => {
      frame = 0;
      render(panel(), element);
    });
  }

  const panel = () => html`<section class="appearance" aria-label="Appearance">
    ${ofPart(chosenPart(store.get()))} ${read.says ? html`<p class="says">${saying()}</p>` : nothing} ${read.target ? lobes() : nothing}
    ${further.view()} ${workshop.view()} ${read.target && !read.says ? [theClass(), theCoat()] : nothing}
    <div class="actions">
      <button type="button" @click=${pin} title="Keep this one on the right of the picture, to compare others with it">
        Pin as B
      </button>
      ${store.get().view.mode === 'single' ? nothing : html`<button type="button" @click=${unpin}>One picture</button>`}
    </div>
  </section>`;

  /** Which part of a mixture is looked at. */
  const ofPart = (part) =>
    part ? html`<p class="says">The lobes of the chosen part alone${part.name ? `, ${part.name}` : ''}.</p>` : nothing;

  const saying = () => (read.target ? `Its lobes can be seen, but not dragged. ${capital(read.says)}.` : capital(read.says));

  /** The target under the hand: as it is asked for while it is held, else as it is. */
  const underHand = () => ((held || wishes.busy) && asked ? asked : read.target);

  const lobes = () => html`
    ${handles({
      lobes: read.target.lobes,
      asked: asked?.lobes ?? null,
      hand: underHand().lobes,
      chosen,
      fixed: Boolean(read.says),
      onChoose: choose,
      onMove(index, { blur, energy, axis }) {
        const old = underHand().lobes[index];
        const alpha = axis === undefined ? () => withBlur(old, blur) : () => old.alpha.with(axis, blur);
        wish(index, {
          ...(blur !== undefined && { alpha: roundedBlur(alpha()) }),
          ...(energy !== undefined && !holdsOf(index).energy && { energy: withMean(old.energy, energy).map(rounded) }),
        });
      },
      onLetGo: letGo,
    })}
    <ol class="lobes" aria-label="Lobes">
      ${read.target.lobes.map((lobe, index) => [row(lobe, index), refusal(index), between(index)])}
    </ol>
    ${refused && refused.lobe === null ? html`<p class="problem">${capital(refused.text)}.</p>${waysOut()}` : nothing}
    <fieldset ?disabled=${Boolean(read.says)}>
      <legend>Lobe ${chosen + 1}</legend>
      ${controls(underHand().lobes[chosen], chosen)}
    </fieldset>
  `;

  /** Why a lobe's energy, or its number and kind of interfaces, cannot be asked for. */
  const holdsOf = (index) => read.held?.[index] ?? {};

  /** Controls, or where these ask for what cannot be, the reason below them. */
  const unless = (why, controls) =>
    why ? html`<fieldset class="held" disabled>${controls}</fieldset><p class="faint">${capital(why)}.</p>` : controls;

  const row = (lobe, index) => html`<li>
    <button type="button" class="lobe" aria-pressed=${index === chosen} @click=${() => choose(index)}>
      <span class="swatch" .style=${styles({ background: hex(hue(lobe)) })}></span>
      <b>${index + 1}</b>
      <span>energy ${shown(mean(lobe.energy))}</span>
      <span title=${described(lobe)}>blur ${Array.isArray(lobe.alpha) ? lobe.alpha.map(brief).join(', ') : shown(lobe.alpha)}</span>
      <span class="faint">${lobe.interfaces > 1 ? `${lobe.interfaces} × ` : ''}${lobe.base}</span>
    </button>
  </li>`;

  const refusal = (index) =>
    refused?.lobe === index
      ? html`<li class="refused">
          ${asked ? html`Asked: ${difference(asked.lobes[index], read.target.lobes[index])}.` : nothing}
          ${capital(refused.text)}.
          ${waysOut()}
        </li>`
      : nothing;

  const waysOut = () =>
    ways?.length
      ? html`<div class="actions" role="group" aria-label="Ways out">
          ${ways.map((way) => html`<button type="button" @click=${() => take(way)}>${capital(way.words)}</button>`)}
        </div>`
      : nothing;

  function between(index) {
    const haze = read.haze?.[index];
    if (!haze) return nothing;
    const ratios = haze.energy.filter((ratio) => ratio !== null);
    return html`<li class="haze" title="The lobe below against the one above: ratios of their energies and widths">
      haze ${haze.width === null ? 'around a mirror' : html`${brief(haze.width)} × as wide`}${
        ratios.length ? html`, ${brief(mean(ratios))} × the energy` : nothing
      }
    </li>`;
  }

  function controls(lobe, index) {
    const edit = (key, valueOf = (value) => value) => ({
      move: (value) => wish(index, { [key]: valueOf(value) }),
      set: (value) => once(index, { [key]: valueOf(value) }),
      settle: letGo,
      refuse: (words) => messages.complain('appearance', words, { passing: true }),
    });
    const energy = edit('energy', (value) => withMean(lobe.energy, Math.max(value, 1e-6)).map(rounded));
    const colours = [
      line('Colour', colourRow({ label: 'Energy', value: lobe.energy, spec: SHARE, edit: edit('energy') })),
      line('Energy', number({ ...share('Energy', mean(lobe.energy)), edit: energy, span: null, decades: ENERGIES })),
    ];
    const made = line(
      'Made by',
      html`<div class="made">
        ${menu({
          label: 'Number of interfaces',
          value: String(lobe.interfaces),
          options: [
            ['1', '1 interface'],
            ['2', '2 interfaces'],
            ['3', '3 interfaces'],
          ],
          choose: (count) => once(index, { interfaces: Number(count) }),
        })}
        ${menu({ label: 'Kind of base', value: lobe.base, options: BASES, choose: (base) => once(index, { base }) })}
      </div>`,
    );
    return html`
      ${unless(holdsOf(index).energy, colours)} ${blur(lobe, index, edit)} ${unless(holdsOf(index).interfaces, made)}
      ${
        lobe.base === 'conductor'
          ? line('Tint', number({ ...share('Tint', lobe.tint), edit: edit('tint') }))
          : nothing
      }
    `;
  }

  /** One blur while locked, else one for each axis, and how these are turned. */
  function blur(lobe, index, edit) {
    const locked = !Array.isArray(lobe.alpha) && unlocked !== index;
    const lock = iconButton({
      label: locked ? 'Blur: one for each axis' : 'Blur: the same for both axes',
      icon: locked ? 'locked' : 'unlocked',
      pressed: locked,
      name: 'lock',
      act() {
        unlocked = locked ? index : null;
        if (Array.isArray(lobe.alpha)) once(index, { alpha: rounded(blurOf(lobe)), rotation: 0 });
        paint();
      },
    });
    const row = (name, control) => html`<div class="parameter">
      <span class="name">${name}</span><span class="extras">${lock}</span>
      <div class="control">${control}</div>
    </div>`;
    if (locked) return row('Blur', number({ ...share('Blur', lobe.alpha), edit: edit('alpha') }));
    const axes = axesOf(lobe);
    const axis = (value, place) => html`<div class="axis">
      <span class="tag">${'uv'[place]}</span>
      ${number({ ...share(`Blur ${'uv'[place]}`, value), edit: edit('alpha', (next) => axes.with(place, next)) })}
    </div>`;
    const turn = { label: 'Rotation', value: Math.round(100 * lobe.rotation) / 100, edit: edit('rotation') };
    return [row('Blur', axes.map(axis)), axes[0] === axes[1] ? nothing : line('Rotation', dial(turn))];
  }

  const theClass = () => html`<details class="part" open>
    <summary>Class of lobe ${chosen + 1}</summary>
    ${classes.view()}
  </details>`;

  // Coats

  function theCoat() {
    const edit = (key) => ({
      move: (value) => setCoat({ [key]: value }),
      set: (value) => setCoat({ [key]: value }),
      settle() {},
      refuse: (words) => messages.complain('appearance', words, { passing: true }),
    });
    const one = (name, key) => ({ label: `${name} of the coat`, value: coat[key], edit: edit(key) });
    const { eta, alpha } = session.schema.interface;
    return html`<details class="part">
      <summary>Coat</summary>
      ${line('Index', number({ ...one('Index', 'eta'), spec: eta, span: [1, 3] }))}
      ${line('Roughness', number({ ...one('Roughness', 'alpha'), spec: alpha }))}
      <div class="actions">
        <label class="flag">
          <input type="checkbox" .checked=${coat.keep} @change=${({ target }) => setCoat({ keep: target.checked })} />
          keep the appearance below
        </label>
        <button type="button" @click=${putCoat}>Coat it</button>
      </div>
      ${
        coatLobe
          ? html`<p class="says">
              Its own lobe: energy ${shown(mean(coatLobe.energy))}, blur ${shown(mean(coatLobe.alpha))}.
            </p>`
          : nothing
      }
      ${coatSays ? html`<p class="refused" role="alert">${coatSays}</p>` : nothing}
    </details>`;
  }

  function setCoat(changes) {
    coat = { ...coat, ...changes };
    paint();
  }

  async function putCoat() {
    await messages.attempt('appearance', async () => {
      const before = now();
      const answer = await call('coat', { ...question(), ...coat });
      if (before !== now()) return;
      if (answer.material) store.run(addCoat, answer.material);
      coatLobe = answer.coat ?? null;
      const says = answer.error ? [answer.error] : answer.losses;
      coatSays = says.map((why) => `${capital(why)}.`).join(' ');
      paint();
    });
  }

  // Side by side

  function pin() {
    const { name, model, switches } = store.get();
    const other = { material: documentOf(store.get()), title: `B: ${name || 'pinned'}`, model, switches };
    store.run(setView, { mode: 'split', other });
  }

  const unpin = () => store.run(setView, { mode: 'single' });

  const stop = store.subscribe(follow);
  const stopListening = live?.onChange((online) => online && follow());
  follow();
  return {
    follow,
    /** Whether nothing is asked for, and nothing under the hand. */
    get quiet() {
      return !held && !wishes.busy && !reading && !further.busy && !workshop.busy;
    },
    /** Stores the target of a material by a model in advance. */
    know: (material, model, answer) => known.set(textOf(material, { model, switches: {} }), { says: null, ...answer }),
    destroy() {
      stop();
      stopListening?.();
      classes.stop();
      cancelAnimationFrame(frame);
      render(nothing, element);
    },
  };
}

const rounded = (value) => Number(value.toPrecision(4));
const roundedBlur = (alpha) => (Array.isArray(alpha) ? alpha.map(rounded) : rounded(alpha));
const brief = (value) => Number(value.toPrecision(2));

/** A number from 0 to 1 as a control shows it. */
const share = (label, value) => ({
  label,
  value: Number(Number(value.toPrecision(3)).toFixed(5)),
  spec: SHARE,
});

/** What was asked of a lobe that it has not got. */
function difference(wish, got) {
  const parts = [
    ['blur', described(wish), described(got)],
    ['energy', shown(mean(wish.energy)), shown(mean(got.energy))],
  ].filter(([, a, b]) => a !== b);
  if (!parts.length) return 'another colour';
  return parts.map(([name, a, b]) => `${name} ${a}, got ${b}`).join('; ');
}
