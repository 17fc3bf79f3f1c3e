// The pigments of a medium: each with its name, its colour, its coefficients and its concentration.

import { html, nothing } from 'lit-html';
import { addPigment, removePigment, setPigment } from '../state/commands.js';
import { absorptionFor, isKnown, masstone } from '../state/pigments.js';
import { channelsOf, picks } from './colour.js';
import { iconButton } from './controls.js';
import { text } from './typing.js';

const FRESH = { K: [8, 3, 0.5], S: 4, concentration: 0.1 }; // of a new pigment, a blue
const SPANS = { concentration: [0, 1] }; // where sliders end; fields take more

/** The pigments of a layer, and a button for another one; `row` draws a parameter. */
export function pigments({ services, layer, value, spec, row }) {
  const { store, session } = services, lacks = services.lacks('pigments');
  const { sigma_a: a, sigma_s: s, g } = session.schema.medium;
  const given = { sigma_a: a.default, sigma_s: s.default, g: g.default };
  const words = value.length ? 'Add a pigment' : 'Describe absorption and scattering by pigments';
  const measured = ['sigma_a', 'sigma_s'].some((key) => isTable(layer.keys[key])) && 'Pigments take the place of numbers and colours, not of tables or images';
  const why = lacks || measured || '';
  return {
    control: html`<fieldset class="films" ?disabled=${lacks} title=${lacks || nothing}>
      ${value.length ? nothing : html`<span class="none">none</span>`}
      <ol>
        ${value.map((pigment, n) => card({ services, layer, pigment, n, row }))}
      </ol>
    </fieldset>`,
    extras: iconButton({
      label: words,
      icon: 'plus',
      act: () => store.run(addPigment, layer.id, FRESH, given),
      disabled: Boolean(why) || value.length >= spec.most,
      title: why || words,
    }),
  };
}

const isTable = (value) => typeof value === 'object' && !Array.isArray(value);

/** How a pigment is called: by its name, its file, or its place among the others. */
const nameOf = ({ name, pigment }, place) => name || pigment?.split('/').at(-1) || `pigment ${place}`;

function card({ services, layer, pigment, n, row }) {
  const { store, session, edits, focus } = services, name = nameOf(pigment, n);
  const schema = session.schema.pigment, keys = pigment.pigment ? ['concentration'] : ['K', 'S', 'concentration'];
  const place = { id: `${layer.id}.pigment${n}`, kind: 'pigment', keys: pigment };
  const part = (key) => {
    const act = (next) => [setPigment, layer.id, n, { [key]: next }];
    const found = pigment[key] ?? schema[key].default;
    return row({ layer: place, key, label: name, value: found, spec: schema[key], act, owner: layer, span: SPANS[key] });
  };
  const remove = () => {
    store.run(removePigment, layer.id, n);
    focus(`[data-layer="${layer.id}"] > .head .grip`);
  };
  return html`<li class="film pigment" data-pigment=${n} aria-label=${`Pigment ${n}: ${name}`}>
    <div class="head">
      <input
        type="text"
        aria-label=${`Name of pigment ${n}`}
        placeholder=${name}
        spellcheck="false"
        .value=${text(pigment.name ?? '')}
        @change=${({ target }) => store.run(setPigment, layer.id, n, { name: target.value })}
      />
      <span class="buttons">${iconButton({ label: `Remove ${name}`, icon: 'remove', act: remove })}</span>
    </div>
    ${isKnown(pigment) && channelsOf(pigment.S).every((s) => s > 0) ? colourOf({ edits, layer, pigment, n, name }) : nothing} ${keys.map(part)}
  </li>`;
}

/** The colour of a thick layer of a pigment alone; one that is picked changes K. */
function colourOf({ edits, layer, pigment, n, name }) {
  const act = (light) => [setPigment, layer.id, n, { K: absorptionFor(light, pigment.S) }];
  const edit = edits.of(`${layer.id}.pigment${n}.colour`, act, `layer.${layer.id}`, layer.id);
  return html`<div class="parameter" title="Of a layer that nothing shines through, without a surface; changes K">
    <span class="name">Colour</span>
    <div class="control">${picks({ label: `${name}, colour`, rgb: channelsOf(masstone(pigment)), edit })}</div>
  </div>`;
}
