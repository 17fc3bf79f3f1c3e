// Small line drawings, 16 units square, in the colour of the text.

import { html, svg } from 'lit-html';

const draw = (shape) =>
  html`<svg class="icon" viewBox="0 0 16 16" aria-hidden="true" focusable="false">${shape}</svg>`;
const path = (d) => draw(svg`<path d=${d} />`);

export const icons = {
  undo: path('M6 3 2.5 6.5 6 10M3 6.5h6.5a4 4 0 0 1 0 8H7'),
  redo: path('M10 3l3.5 3.5L10 10M13 6.5H6.5a4 4 0 0 0 0 8H9'),
  grip: path('M3 5h10M3 8h10M3 11h10'),
  duplicate: path('M5.5 5.5h8v8h-8zM10.5 5.5v-3h-8v8h3'),
  remove: path('M4 4l8 8M12 4l-8 8'),
  rename: path('M3 13l.7-3L11 2.7 13.3 5 6 12.3zM9.5 4.2l2.3 2.3'),
  beside: path('M2.5 3h11v10h-11zM8 3v10'),
  fold: path('M3.5 6l4.5 4.5L12.5 6'),
  unfold: path('M6 3.5L10.5 8 6 12.5'),
  plus: path('M8 3v10M3 8h10'),
  locked: path('M4 7.5h8v6H4zM5.5 7.5v-2a2.5 2.5 0 0 1 5 0v2'),
  unlocked: path('M4 7.5h8v6H4zM5.5 7.5v-3a2.5 2.5 0 0 1 4.7-1.2'),
  eyedropper: path('M9 4.5l2.5 2.5M3 13l.6-2.6L10 4l2 2-6.4 6.4zM11 3a1.4 1.4 0 0 1 2 2l-1 1'),
  swatches: path('M2.5 2.5h5v5h-5zM8.5 2.5h5v5h-5zM2.5 8.5h5v5h-5zM8.5 8.5h5v5h-5z'),
  aim: path('M8 1.5v4M8 10.5v4M1.5 8h4M10.5 8h4M8 5a3 3 0 1 0 .01 0'),
  tag: path('M2.5 2.5h5l6 6-5 5-6-6zM5.5 5.5h.01'),
  texture: path('M2.5 3h11v10h-11zM2.5 11l3.5-4 3 3 1.5-1.5 3 3M10.5 6h.01'),
};
