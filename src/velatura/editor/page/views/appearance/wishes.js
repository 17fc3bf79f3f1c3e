// Wishes beyond lobes: what is reflected at a second angle, what passes, and the colours of a base, of a film, and of a mixture.

import { html, nothing } from 'lit-html';
import { setAppearance } from '../../state/commands.js';
import { documentOf, stackOf } from '../../state/material.js';
import { setWeights } from '../../state/parts.js';
import { colourRow } from '../colour.js';
import { capital, menu, number } from '../controls.js';
import { mean } from '../plots/scale.js';
import { line } from '../settings.js';
import { withMean } from './looks.js';
import { oneAtATime } from './questions.js';

const TITLES = {
  grazing: 'Reflected at a second angle',
  passed: 'Passes',
  body: 'Base, seen from outside',
  film: 'Film, by its thickness',
  mixture: 'Mixture, by its weights',
};
const MIXTURE = 'mixture'; // whose parts are looked at one at a time otherwise
const STEEPEST = { low: 0, high: 89, strict: false };
const SHARE = { low: 0, high: 1, strict: false };
const HAZE = { low: 0, high: 0.9995, strict: false };
const DARKEST = 1e-6; // mean energy that a hand can ask for

const rounded = (value) => Number(value.toPrecision(4));

/**
 * @param {{store, call, edits, messages}} services
 * @param {{question: function, ask: function, paint: function}} panel what the panel around knows and does
 */
export function createWishes({ store, call, edits, messages }, panel) {
  let read = []; // what the stack shows of each wish: {key, energy, haze, lobes}, or lacks for it: {lacks, way, material}
  let mixed = []; // the same of the mixture that it is a part of
  let text = ''; // what was asked about
  let angle = 75;
  let tilted = 0; // the lobe that is seen at that angle, by its interface from 1; 0 for all that is reflected
  let origin = null; // material that the wishes of a step start from
  let asked = null; // {key, wish}, where it could not be had, or not yet
  let refused = null; // why it could not
  let held = false;
  let rough = null; // wish whose answer is approximate

  const question = () => ({ ...panel.question(), angle });
  const textNow = () => JSON.stringify([question(), store.get().parts && documentOf(store.get())]);

  /** Reads the material anew where it is another one. */
  async function follow() {
    if (held || wishes.busy || textNow() === text) return;
    const own = textNow();
    [text, asked, refused] = [own, null, null];
    const found = await shownBy(stackOf(store.get()));
    if (!found || own !== text) return;
    [read, mixed] = [found, []];
    if (!read.find(({ lobes }) => lobes)?.lobes[tilted - 1]) tilted = 0;
    panel.paint();
    if (store.get().parts) await readMixture();
  }

  /**
   * The wishes that a material may be asked for: none where its lobes cannot be read, for which the panel has the reason; null
   * where a later question took the place of this one.
   */
  async function shownBy(material) {
    try {
      const answer = await panel.ask('wishes', { ...question(), material });
      return answer && answer.wishes;
    } catch {
      return [];
    }
  }

  async function readMixture() {
    const own = text;
    const found = await shownBy(documentOf(store.get()));
    if (!found || own !== text || held) return;
    mixed = found;
    panel.paint();
  }

  const wishes = oneAtATime(
    async (wanted) => {
      const coarse = held;
      const body = { ...question(), material: origin, target: { [wanted.key]: wanted.wish }, coarse };
      try {
        const answer = (await panel.ask('wish', body)) ?? (held ? null : await call('wish', body)); // what rests is answered
        if (!answer) return;
        rough = coarse ? wanted : null;
        accept(answer, wanted.key);
        messages.forgive('appearance');
      } catch (error) {
        messages.fail('appearance', error);
      }
    },
    () => held || comeToRest(),
  );

  function accept({ material, wishes: shown, snapped, why }, key) {
    refused = snapped ?? why ?? null;
    if (material) {
      if (key === MIXTURE) mixed = shown;
      else read = shown;
      edits.drag('appearance', key === MIXTURE ? setWeights : setAppearance, material);
      text = textNow();
    }
    panel.paint();
  }

  /** Asks again for what was answered approximately; then ends the step. */
  function comeToRest() {
    if (rough) {
      const wanted = rough;
      rough = null;
      return wishes.want(wanted);
    }
    if (mixed.length && asked?.key !== MIXTURE) readMixture();
    if (!refused) asked = null;
    origin = null;
    edits.settle();
    panel.paint();
  }

  /** Requests changes of a wish; those that the same step has asked for remain. */
  function want(key, changes) {
    if (asked?.key !== key) origin = null;
    const before = origin ? asked.wish : key === 'grazing' ? { angle, ...(tilted && { lobe: tilted }) } : {};
    origin ??= (key === MIXTURE ? documentOf : stackOf)(store.get());
    asked = { key, wish: { ...before, ...changes } };
    held = true;
    wishes.want(asked);
    panel.paint();
  }

  function letGo() {
    held = false;
    if (!wishes.busy) comeToRest();
  }

  const refuse = (words) => messages.complain('appearance', words, { passing: true });

  const edit = (key, changesOf) => ({
    move: (value) => want(key, changesOf(value)),
    set: (value) => {
      want(key, changesOf(value));
      letGo();
    },
    settle: letGo,
    refuse,
  });

  /** A wish as it is asked for while its step goes on, so that hues do not drift by its answers; else as the material, or
   * the chosen lobe of it, has it. */
  const underHand = (shown) => ({
    ...shown,
    ...(tilted && shown.lobes?.[tilted - 1]),
    ...(origin && asked?.key === shown.key && asked.wish),
  });

  function row(shown) {
    const { key, energy, haze, alpha } = underHand(shown);
    const title = TITLES[key];
    const toMean = (value) => ({ energy: withMean(energy, Math.max(value, DARKEST)).map(rounded) });
    const toHaze = (value) => ({ haze: rounded(value) });
    const toBlur = (value) => ({ alpha: rounded(value) });
    const blur = () => number({ label: 'Blur at a second angle', value: rounded(alpha), spec: SHARE, edit: edit(key, toBlur) });
    const tint = () => [
      line('Colour', colourRow({ label: title, value: energy, spec: SHARE, edit: edit(key, (value) => ({ energy: value })) })),
      line('Energy', number({ label: `${title}: share`, value: rounded(mean(energy)), spec: SHARE, edit: edit(key, toMean) })),
    ];
    return html`<fieldset>
      <legend>${title}</legend>
      ${key === 'grazing' ? seen(shown.lobes) : nothing} ${shown.lacks ? lacking(shown) : tint()}
      ${key === 'grazing' && tilted ? line('Blur', blur()) : nothing}
      ${haze === undefined ? nothing : line('Haze', number({ label: 'Haze', value: rounded(haze), spec: HAZE, edit: edit(key, toHaze) }))}
      ${refused && asked?.key === key ? html`<p class="refused">${capital(refused)}.</p>` : nothing}
    </fieldset>`;
  }

  const turn = (value) => {
    angle = Math.round(10 * value) / 10;
    follow();
  };
  const ofAngle = { move: turn, set: turn, settle() {}, refuse };

  /** At which angle light is seen, and of which lobe. */
  const seen = (lobes) => [
    line('Angle', number({ label: 'Second angle', value: angle, spec: STEEPEST, edit: ofAngle })),
    line('Light of', menu({ label: 'Light at a second angle', value: String(tilted), options: whose(lobes), choose: look })),
  ];
  const whose = (lobes) => [['0', 'All'], ...lobes.map((_, k) => [String(k + 1), `The lobe of interface ${k + 1}`])];

  function look(lobe) {
    [tilted, asked, refused, origin] = [Number(lobe), null, null, null];
    panel.paint();
  }

  const lacking = ({ lacks, way, material }) => html`<p class="faint">
    ${capital(lacks)}.
    <button type="button" @click=${() => store.run(setAppearance, material)}>Add ${way}</button>
  </p>`;

  return {
    follow,
    view: () =>
      read.length + mixed.length
        ? html`<details class="part further">
            <summary>Further wishes</summary>
            ${[...mixed, ...read].map(row)}
          </details>`
        : nothing,
    get busy() {
      return held || wishes.busy;
    },
  };
}
