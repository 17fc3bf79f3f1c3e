// What a state compares: the open material with one other, or with some beside it.

const KEPT = ['name', 'source', 'exterior', 'thin', 'layers', 'parts', 'part', 'model', 'switches', 'document'];
const BESIDE = ['b', 'c', 'd']; // slots of the viewport

/** Whether a view compares the material with one other, over the whole picture. */
export const isPaired = ({ mode }) => mode === 'split' || mode === 'difference';

/** Whether the other one is a material too, and not the truth or a photograph. */
export const isOfMaterials = (view) => isPaired(view) && !view.other?.truth && !view.other?.photograph;

/** What is kept of a state, to go back to it or to put it beside others. */
export const keptOf = (state) => Object.fromEntries(KEPT.map((key) => [key, state[key]]));

/** The materials beside the open one: {slot, number (of the snapshot, or null), kept}. */
export const besideOf = ({ view }) => (view.mode === 'tiles' ? (view.tiles ?? []) : []);

/** The slot that one more would take; undefined where there is none. */
export const slotBeside = (state) => BESIDE.find((name) => besideOf(state).every(({ slot }) => slot !== name));
