// What a document may hold that comes from an address or a file where no Python checks it.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { check } from '../../src/velatura/editor/page/state/check.js';

const index = { kind: 'index', low: 0.1, high: 30, strict: false };
const SESSION = {
  schema: {
    material: { name: { kind: 'text' }, exterior: { kind: 'number', low: 0.1, high: 30 }, thin: { kind: 'flag' } },
    interface: {
      eta: index,
      conductor: { kind: 'choice', options: ['mirror', 'Au'] },
      alpha: { kind: 'pair', low: 0, high: 1 },
      films: { kind: 'films', most: 2 },
    },
    film: { eta: index, k: index, thickness_nm: { kind: 'number', low: 0, high: 5000 } },
    medium: {
      sigma_a: { kind: 'colour', low: 0, high: null },
      g: { kind: 'number', low: -1, high: 1, strict: true },
      phase: { kind: 'phase' },
    },
  },
  names: { dielectrics: { bk7: 1.5 }, conductors: { Au: {} }, pages: { 'a/b/c': {} } },
};
const FILM = { eta: 1.4, thickness_nm: 100 };
const of = (...layers) => ({ layers });

test('materials of all kinds of values pass', () => {
  const coat = { interface: { eta: [1.5, 1.51, 1.52], alpha: [0.1, 0.3] } };
  const medium = { medium: { sigma_a: [0, 1, 2], g: 0.9 } };
  check({ name: 'Gold', exterior: 1.33, thin: false, ...of(coat, medium, { interface: { conductor: 'Au' } }) }, SESSION);
  check(of({ interface: { eta: 'bk7', alpha: 0 } }, { medium: null }), SESSION);
  check(of({ interface: { eta: { refractiveindex: 'a/b/c' } } }), SESSION);
  check(of({ interface: { eta: 1.5, films: [{ eta: 'bk7', thickness_nm: 200 }] } }), SESSION);
});

for (const [material, why] of [
  [null, /layers: must hold at least one layer/],
  [of(), /layers: must hold at least one layer/],
  [of('interface'), /layer 0: must be one of/],
  [of({ material: {} }), /layer 0: must be one of/],
  [of({ interface: {}, medium: {} }), /layer 0: must be one of/],
  [of({ interface: { constructor: 1 } }), /layer 0 \(interface\): constructor: is not a key/],
  [of({ interface: { eta: 1.5 } }, { medium: { g: 1 } }), /layer 1 \(medium\): g: must lie in -1 to 1, both excluded/],
  [of({ medium: { phase: 'rayleigh' } }), /phase: phase functions need Python/],
  [of({ medium: { sigma_a: -1 } }), /sigma_a: must be at least 0/],
  [of({ medium: { sigma_a: [1, 2] } }), /sigma_a: must not be 2 numbers/],
  [of({ medium: { sigma_a: 'red' } }), /sigma_a: must be a number/],
  [of({ interface: { alpha: { texture: 'a.png' } } }), /alpha: textures and spectra need Python/],
  [of({ interface: { eta: { refractiveindex: 'a/b' } } }), /eta: textures and spectra need Python/],
  [of({ interface: { eta: 'glass' } }), /eta: glass is not a known name/],
  [of({ interface: { eta: 'constructor' } }), /eta: constructor is not a known name/],
  [of({ interface: { conductor: 'Fe' } }), /conductor: must be one of mirror, Au/],
  [of({ interface: { films: 3 } }), /films: must be a list of films/],
  [of({ interface: { films: [{}, {}, {}] } }), /films: must be at most 2 films/],
  [of({ interface: { films: [3] } }), /films: film 0: eta: missing/],
  [of({ interface: { films: [FILM, { eta: 1.5 }] } }), /films: film 1: thickness_nm: missing/],
  [of({ interface: { films: [{ ...FILM, thickness_nm: 6000 }] } }), /film 0: thickness_nm: must lie in 0 to 5000/],
  [of({ interface: { films: [{ ...FILM, thickness_nm: { texture: 'a.png' } }] } }), /textures and spectra need Python/],
  [{ ...of({ interface: {} }), thin: 1 }, /thin: must be true or false/],
])
  test(`${JSON.stringify(material)} is refused in words`, () => assert.throws(() => check(material, SESSION), why));
