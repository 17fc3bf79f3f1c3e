// What a workshop has: substances and lacquers, how thick coats are at least, and the material made of these.

import { html, nothing } from 'lit-html';
import { setAppearance } from '../../state/commands.js';
import { enabled, metalOf, pageOf } from '../../state/material.js';
import { channelsOf, hex } from '../colour.js';
import { iconButton, menu, number, numberField, shown, styles } from '../controls.js';
import { dielectrics, metals } from '../names.js';
import { line } from '../settings.js';

const MOST = 24; // substances, as in Python
const INDEX = { low: 1, high: 4, strict: false };
const DEPTH = { low: 0, high: 1e6, strict: false };
const DECADES = [-2, 3]; // of its slider

/**
 * @param {{store, session, call, messages}} services
 * @param {{question: function, paint: function}} panel what the panel around knows and does
 */
export function createWorkshop({ store, session, call, messages }, panel) {
  const { names } = session;
  let stock = []; // as `available` of a target has them
  let thinnest = 0;
  let index = 1.5; // that can be added
  let made = { document: null, choices: [] }; // materials made of them, from an open one, and how far they are off
  let asking = false;

  const written = (name) => (Object.hasOwn(names.pages, name) ? { refractiveindex: name } : name);
  const titleOf = (entry) => {
    const page = pageOf(entry);
    if (page) return names.pages[page]?.title ?? page;
    return entry.sigma_a === undefined ? String(entry) : `lacquer ${shown(entry.eta)}`;
  };

  const refuse = (words) => messages.complain('appearance', words, { passing: true });

  /** What a control does with values that the panel keeps. */
  const kept = (keep) => {
    const take = (value) => {
      keep(value);
      panel.paint();
    };
    return { move: take, set: take, settle() {}, refuse };
  };
  const ofIndex = kept((value) => (index = value));
  const ofDepth = kept((value) => (thinnest = value));

  function add(...entries) {
    const known = new Set(stock.map((entry) => JSON.stringify(entry)));
    const fresh = entries.filter((entry) => !known.has(JSON.stringify(entry)));
    if (stock.length + fresh.length > MOST) refuse(`A workshop has ${MOST} substances at most.`);
    else stock = [...stock, ...fresh];
    panel.paint();
  }

  function remove(entry) {
    stock = stock.filter((other) => other !== entry);
    panel.paint();
  }

  /** What lies below the interfaces of the material, a tinted coat as a lacquer; numbers of a metal have no name. */
  function ofMaterial() {
    const layers = enabled(store.get());
    return layers.flatMap(({ kind, keys }, place) => {
      if (kind !== 'interface') return [];
      const metal = metalOf(keys), below = layers[place + 1];
      if (metal !== undefined) return metal === 'mirror' ? [] : [written(metal)];
      if (keys.k !== undefined || (typeof keys.eta === 'object' && !pageOf(keys.eta))) return [];
      const tint = below?.kind === 'medium' ? below.keys.sigma_a : undefined;
      const isLacquer = typeof keys.eta === 'number' && (typeof tint === 'number' || Array.isArray(tint));
      return [isLacquer ? { eta: keys.eta, sigma_a: tint } : keys.eta];
    });
  }

  async function make() {
    asking = true;
    panel.paint();
    const { document } = store.get();
    await messages.attempt('appearance', async () => {
      made = { document, ...(await call('stock', { ...panel.question(), available: stock, thinnest })) };
    });
    asking = false;
    panel.paint();
  }

  const chip = (entry) => html`<li>
    ${entry.sigma_a === undefined ? nothing : swatch(entry)} ${titleOf(entry)}
    ${iconButton({ label: `Remove ${titleOf(entry)}`, icon: 'remove', act: () => remove(entry) })}
  </li>`;

  /** What a lacquer of a unit of depth lets through. */
  const swatch = ({ sigma_a: sigma }) => {
    const background = hex(channelsOf(sigma).map((channel) => Math.exp(-channel)));
    return html`<span class="swatch" .style=${styles({ background })}></span>`;
  };

  /** What a choice is made of, from the top, and how deep its media are where that is theirs. */
  function madeOf({ layers }) {
    const words = layers.map(({ interface: keys, medium }) => {
      if (medium) return medium.depth === undefined ? [] : [`${shown(medium.depth)} deep`];
      return keys ? [metalOf(keys) ?? (keys.k === undefined ? titleOf(keys.eta) : 'metal')] : [];
    });
    return words.flat().join(', ');
  }

  const choice = ({ material, off }) => html`<li>
    <button type="button" @click=${() => store.run(setAppearance, material)}>${madeOf(material)}</button>
    <span class="faint" title="Distance of its lobes, in units of CIE 1976">off by ${shown(Number(off.toPrecision(2)))}</span>
  </li>`;

  const options = [['', 'Add a substance'], ...metals(names), ...dielectrics(names)];

  return {
    view: () => html`<details class="part workshop">
      <summary>What a workshop has</summary>
      <ul class="stock" aria-label="Substances">${stock.map(chip)}</ul>
      ${line('By name', menu({ label: 'Add a substance', value: '', options, choose: (name) => name && add(written(name)) }))}
      ${line(
        'By index',
        html`<div class="made">
          ${numberField({ label: 'Index of a substance', value: index, spec: INDEX, edit: ofIndex })}
          <button type="button" @click=${() => add(index)}>Add</button>
        </div>`,
      )}
      ${line(
        'Coats from',
        number({ label: 'Depth of coats at least', value: thinnest, spec: DEPTH, decades: DECADES, edit: ofDepth }),
      )}
      <div class="actions">
        <button type="button" @click=${() => add(...ofMaterial())}>Add those of the material</button>
        <button type="button" ?disabled=${asking || !stock.length} @click=${make}>Make it of these</button>
      </div>
      ${
        made.document === store.get().document
          ? html`<ol class="choices" aria-label="Made of these">${made.choices.map(choice)}</ol>`
          : nothing
      }
    </details>`,
    get busy() {
      return asking;
    },
  };
}
