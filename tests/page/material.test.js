// The values of a material by flat name, as the schema of the session declares them.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { flat } from '../../src/velatura/editor/page/state/material.js';

const SESSION = {
  names: { dielectrics: { bk7: 1.5 }, conductors: { Al: { eta: [1, 2, 3], k: [4, 5, 6] } }, pages: { Ti: { eta: [7, 8, 9], k: [3, 2, 1] } } },
  schema: {
    interface: {
      eta: { kind: 'index', default: null },
      k: { kind: 'index', default: null },
      conductor: { kind: 'choice', default: null },
      alpha: { kind: 'pair', default: 0 },
      sheen: { kind: 'number', default: 0.5 },
    },
    medium: {
      depth: { kind: 'number', default: 1 },
      sigma_a: { kind: 'colour', default: 0 },
      g: { kind: 'number', default: 0 },
      phase: { kind: 'phase', default: null },
      pigments: { kind: 'pigments', default: [] },
    },
    velvet: { fuzz: { kind: 'colour', default: 0 }, weave: { kind: 'choice', default: 'plain' } },
  },
};

const valuesOf = (kind, keys) =>
  flat({ exterior: 1, layers: [{ id: 1, kind, enabled: true, keys }] }, SESSION);

test('an interface has the indices of its kind, and its roughness along both axes', () => {
  const rest = { exterior: 1, layer0_alpha_u: 0.1, layer0_alpha_v: 0.3, layer0_sheen: 0.5 };
  const found = (keys) => valuesOf('interface', { alpha: [0.1, 0.3], ...keys });
  assert.deepEqual(found({ eta: 'bk7' }), { ...rest, layer0_eta: 1.5 });
  assert.deepEqual(found({ conductor: 'Al' }), { ...rest, layer0_eta: [1, 2, 3], layer0_k: [4, 5, 6] });
  const page = { refractiveindex: 'Ti' };
  assert.deepEqual(found({ eta: page, k: page }), { ...rest, layer0_eta: [7, 8, 9], layer0_k: [3, 2, 1] });
  assert.deepEqual(found({ eta: { refractiveindex: 'mine.yml' } }), rest);
  assert.deepEqual(found({ eta: 2, k: 3 }), { ...rest, layer0_eta: 2, layer0_k: 3 });
  assert.deepEqual(found({ conductor: 'mirror' }), rest);
});

test('a parameter, and a kind of layer, is known by being declared', () => {
  assert.equal(valuesOf('interface', { eta: 1.5, sheen: 0.7 }).layer0_sheen, 0.7);
  assert.deepEqual(valuesOf('velvet', { fuzz: [1, 2, 3] }), { exterior: 1, layer0_fuzz: [1, 2, 3] });
});

test('what follows from a phase function, and from a table of a pigment, is left to Python', () => {
  assert.deepEqual(valuesOf('medium', {}), { exterior: 1, layer0_depth: 1, layer0_sigma_a: 0, layer0_g: 0 });
  assert.deepEqual(valuesOf('medium', { phase: 'rayleigh' }), { exterior: 1, layer0_depth: 1, layer0_sigma_a: 0 });
  assert.deepEqual(valuesOf('medium', { pigments: [{ pigment: 'blue.csv' }] }), { exterior: 1, layer0_depth: 1, layer0_g: 0 });
});

test('what varies over the surface is left out', () => {
  const rough = { texture: 'rough.png' };
  assert.deepEqual(valuesOf('interface', { eta: 1.5, alpha: [0.2, rough] }), {
    exterior: 1,
    layer0_eta: 1.5,
    layer0_alpha_u: 0.2,
    layer0_sheen: 0.5,
  });
});
