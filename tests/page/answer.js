// Runs modules of the page on a question in JSON from standard input: a tape on its inputs, the flat values of materials,
// or solutions between those of a table. The answer goes to standard output.

import { text } from 'node:stream/consumers';

import * as commands from '../../src/velatura/editor/page/state/commands.js';
import { flat } from '../../src/velatura/editor/page/state/material.js';
import { decode } from '../../src/velatura/editor/page/arrays.js';
import { interpolated, read } from '../../src/velatura/editor/page/tabulated.js';
import { Tape } from '../../src/velatura/editor/page/render/tape.js';

/** The outputs of a tape, a column each. */
function run({ tape, tables, inputs }) {
  const decoded = Object.fromEntries(Object.entries(tables).map(([name, table]) => [name, decode(table)]));
  const films = (held) => Object.fromEntries(Object.entries(held).map(([name, table]) => [name, decode(table)]));
  const read = (value) => (value.many ? Float64Array.from(value.many) : value.held ? films(value.held) : value);
  const given = Object.fromEntries(Object.entries(inputs).map(([name, value]) => [name, read(value)]));
  const columns = tape.outputs.map(() => []);
  new Tape(tape, decoded, given).run(given, (found, first, end) =>
    found.forEach((column, k) => {
      for (let i = 0; i < end - first; i++) columns[k].push(column.length > 1 ? column[i] : column[0]);
    }),
  );
  return columns;
}

/** The solutions of materials by their values, as lists; null of those that are beyond. */
function between({ table, solution, own, values }) {
  const decoded = read(table);
  return values.map((each) => {
    const found = interpolated(decoded, solution, own, each);
    return found && Object.fromEntries(Object.entries(found).map(([name, { array }]) => [name, [...array]]));
  });
}

const { tapes, materials, session, interpolated: tables = [] } = JSON.parse(await text(process.stdin));
const answer = {
  columns: tapes.map(run),
  values: materials.map((material) => flat(commands.initial(material, session), session)),
  interpolated: tables.map(between),
};
process.stdout.write(JSON.stringify(answer));
