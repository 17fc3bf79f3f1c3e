// Controls of colours, linear RGB: swatches, hexadecimal fields, and a slider for each channel or for hue, saturation, value.

import { html, nothing } from 'lit-html';
import { decoded, encoded } from '../state/colours.js';
import { ref } from 'lit-html/directives/ref.js';
import { iconButton, number, numberField, shown, spanOf, styles } from './controls.js';
import { icons } from './icons.js';
import { text } from './typing.js';

const CHANNELS = ['red', 'green', 'blue'];
const HSV = ['hue', 'saturation', 'value'];
const CLEAREST = 1e-4; // of what a tint lets through of a channel

const within = (c) => Math.max(0, Math.min(1, c));
const rounded = (number) => Number(number.toPrecision(4));

/** A colour, linear from 0 to 1, as the page writes it. */
export const hex = (rgb) =>
  `#${rgb
    .map((c) =>
      Math.round(255 * encoded(within(c)))
        .toString(16)
        .padStart(2, '0'),
    )
    .join('')}`;

/** The linear colour that `#rgb` or `#rrggbb` stands for; null where a text stands for none. */
export function ofHex(written) {
  const found = written.trim().match(/^#?([\da-f]{3}|[\da-f]{6})$/i)?.[1];
  if (!found) return null;
  const size = found.length / 3;
  return [0, 1, 2].map((at) => {
    const digits = found.slice(at * size, (at + 1) * size).repeat(size === 1 ? 2 : 1);
    return decoded(parseInt(digits, 16) / 255);
  });
}

export const channelsOf = (value) => (Array.isArray(value) ? value : [value, value, value]);

/** Hue in degrees, saturation and value of a linear colour, by its channels as a screen takes them. */
export function toHsv(rgb) {
  const seen = rgb.map((c) => encoded(within(c)));
  const value = Math.max(...seen);
  const chroma = value - Math.min(...seen);
  if (chroma === 0) return [0, 0, value];
  const at = seen.indexOf(value);
  const sixth = (seen[(at + 1) % 3] - seen[(at + 2) % 3]) / chroma + 2 * at;
  return [(60 * sixth + 360) % 360, chroma / value, value];
}

export function fromHsv([hue, saturation, value]) {
  return [5, 3, 1].map((offset) => {
    const at = (offset + hue / 60) % 6;
    return decoded(value * (1 - saturation * within(Math.min(at, 4 - at))));
  });
}

/** The colour of the same hue whose largest channel is that; black has the hue of grey. */
function withLargest(rgb, whole) {
  const most = Math.max(...rgb);
  return rgb.map((c) => (c === most ? whole : rounded((whole * c) / most)));
}

/** What is seen of a colour, and its values for one that is picked: where the largest stays `whole`, of that hue alone. */
const relative = (rgb, whole) => ({
  seen: hex(rgb.map((c) => c / (whole ?? 1))),
  worth: (light) => (whole === null ? light.map(rounded) : withLargest(light, whole)),
});

const begun = new WeakMap(); // by swatch that is in use: its colour before, which a pick of 8 bits does not hold

/** A colour to be picked; one that is picked as it was before is as it was before. */
function swatch({ label, rgb, whole = null, edit }) {
  const { seen, worth } = relative(rgb, whole);
  const picked = ({ target }) => {
    if (!begun.has(target)) begun.set(target, { seen, rgb });
    const before = begun.get(target);
    if (target.value !== seen) edit.move(target.value === before.seen ? before.rgb : worth(ofHex(target.value)));
  };
  const settle = ({ target }) => begun.delete(target) && edit.settle();
  return html`<input
    type="color"
    aria-label=${`${label}, swatch`}
    title=${whole === null ? 'Pick a colour' : `Pick a colour; the largest channel stays ${shown(whole)}`}
    .value=${text(seen)}
    @input=${picked}
    @change=${settle}
  />`;
}

/** A colour to be picked or written, and what is `beside` it. */
export function picks({ label, rgb, whole = null, edit, beside = nothing }) {
  const { seen, worth } = relative(rgb, whole);
  const written = ({ target }) => {
    const light = ofHex(target.value);
    target.setCustomValidity(light ? '' : 'must be a colour such as #c86428');
    if (!light) edit.refuse(`${label}: must be a colour such as #c86428, got ${target.value || 'nothing'}`);
    else if (hex(light) !== seen) edit.set(worth(light));
  };
  return html`<div class="picks">
    ${swatch({ label, rgb, whole, edit })}
    <input
      type="text"
      class="hex"
      aria-label=${`${label}, hexadecimal`}
      title="As the screen shows it (sRGB)"
      autocomplete="off"
      spellcheck="false"
      .value=${text(seen)}
      @change=${written}
    />
    ${edit.colours ? [eyedropper({ label, worth, edit }), swatches({ label, seen: rgb.map((c) => within(c / (whole ?? 1))), worth, edit })] : nothing}
    ${beside}
  </div>`;
}

/** A button that takes the colour of a place of the picture. */
function eyedropper({ label, worth, edit }) {
  const act = async () => {
    const rgb = await edit.colours.pick();
    if (rgb) edit.set(worth(rgb));
  };
  const title = 'Take the light of a place of the picture, or of the photograph beside it';
  return iconButton({ label: `${label}, from the picture`, icon: 'eyedropper', title, act });
}

/** Colours that are kept, which a button shows; Delete forgets one. */
function swatches({ label, seen, worth, edit }) {
  const { list, keep, forget } = edit.colours.swatches;
  const place = ({ target, newState }) => {
    if (newState !== 'open') return;
    const { right, bottom } = target.previousElementSibling.getBoundingClientRect(), { clientWidth } = target.ownerDocument.documentElement;
    target.style = styles({ right: `${clientWidth - right}px`, top: `${bottom}px` });
  };
  const one = (rgb) => html`<button
    type="button"
    class="one"
    aria-label=${`Kept colour ${hex(rgb)}`}
    title=${`${hex(rgb)}; Delete forgets it`}
    .style=${styles({ background: hex(rgb) })}
    @click=${({ target }) => {
      target.closest('[popover]').hidePopover();
      edit.set(worth(rgb));
    }}
    @keydown=${({ key }) => key === 'Delete' && forget(rgb)}
  ></button>`;
  const opens = (button) => button && (button.popoverTargetElement = button.nextElementSibling);
  return html`<button type="button" class="small" aria-label=${`${label}, kept colours`} title="Colours that are kept" ${ref(opens)}>
      ${icons.swatches}</button
    ><div class="swatches" popover @beforetoggle=${place}>
      <button type="button" @click=${() => keep(seen.map(rounded))}>Keep this colour</button>
      ${list.map(one)}
    </div>`;
}

/** `edit` for one entry of a list. */
function entryOf(edit, list, index) {
  const replaced = (number) => list.map((old, other) => (other === index ? number : old));
  return {
    ...edit,
    move: (number) => edit.move(replaced(number)),
    set: (number) => edit.set(replaced(number)),
  };
}

/**
 * One number, or a swatch and a slider for each channel; what may exceed 1 is shown relative to its largest.
 *
 * @param {object} given a `value` of a `spec`, and what is `beside` it; with an `hsv`, its sliders are those of hue, saturation and value, from
 *   where they were last: `hsv.latest`, since black and greys have no hue
 */
export function colour({ label, value, spec, edit, span = spanOf(spec), hsv = null, beside = nothing }) {
  if (!Array.isArray(value))
    return html`<div class="grey">${number({ label, value, spec, edit, span })}${beside}</div>`;
  const whole = spec.high === 1 ? null : Math.max(...value) || 1;
  const channel = (index) => {
    const one = entryOf(edit, value, index), name = CHANNELS[index];
    const own = { ...spec, default: channelsOf(spec.default)[index] };
    return html`<div class="channel ${name}">
      ${tag(name)} ${number({ label: `${label}, ${name}`, value: value[index], spec: own, edit: one, span })}
    </div>`;
  };
  return html`<div class="colour">
    ${picks({ label, rgb: value, whole, edit, beside })}
    <div class="channels">
      ${hsv ? hueRows({ label, value, edit, hsv }) : CHANNELS.map((_, index) => channel(index))}
    </div>
  </div>`;
}

const tag = (name) => html`<span class="tag" aria-hidden="true">${name[0].toUpperCase()}</span>`;

function hueRows({ label, value, edit, hsv }) {
  if (hex(fromHsv(hsv.latest ?? [0, 0, 0])) !== hex(value)) hsv.latest = toHsv(value);
  const put = (act) => (next) => {
    hsv.latest = next;
    act(fromHsv(next).map(rounded));
  };
  const all = { ...edit, move: put(edit.move), set: put(edit.set) };
  return HSV.map((name, index) => {
    const spec = { low: 0, high: index === 0 ? 360 : 1 };
    const one = entryOf(all, hsv.latest, index);
    return html`<div class="channel">
      ${tag(name)} ${number({ label: `${label}, ${name}`, value: rounded(hsv.latest[index]), spec, edit: one })}
    </div>`;
  });
}

/** A swatch and a field for each channel, in one row; a colour that is picked keeps the largest channel. */
export function colourRow({ label, value, spec, edit }) {
  const whole = Math.max(...value) || 1;
  const channel = (index) => {
    const now = Number(value[index].toPrecision(3));
    return numberField({ label: `${label}, ${CHANNELS[index]}`, value: now, spec, edit: entryOf(edit, value, index) });
  };
  return html`<div class="rgb">
    ${swatch({ label, rgb: value, whole, edit })}
    ${CHANNELS.map((_, index) => channel(index))}
  </div>`;
}

/** The colour of white light after an absorbing `way`, in units of length, as a swatch of the absorption `sigma`. */
export function tint({ label, sigma, way, edit }) {
  const rgb = channelsOf(sigma).map((s) => Math.exp(-s * way));
  const absorbing = (light) => light.map((t) => rounded(-Math.log(Math.max(within(t), CLEAREST)) / way) + 0);
  const one = { ...edit, move: (light) => edit.move(absorbing(light)), set: (light) => edit.set(absorbing(light)) };
  return picks({ label, rgb, edit: one });
}
