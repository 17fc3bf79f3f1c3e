// Names of measured indices, as menus show them: in groups, by the words that people use for them.

const METALS = {
  'Noble metals': { Ag: 'Silver', Au: 'Gold', Cu: 'Copper', Ir: 'Iridium', Rh: 'Rhodium' },
  'Industrial metals': {
    ...{ Al: 'Aluminium', Be: 'Beryllium', Cr: 'Chromium', Mo: 'Molybdenum', Nb: 'Niobium', Ni: 'Nickel' },
    ...{ Ta: 'Tantalum', V: 'Vanadium', W: 'Tungsten' },
  },
  'Ceramics and oxides': {
    ...{ CuO: 'Copper(II) oxide', Cu2O: 'Copper(I) oxide', TiC: 'Titanium carbide', TiN: 'Titanium nitride' },
    ...{ VC: 'Vanadium carbide', VN: 'Vanadium nitride' },
  },
  'Other conductors': {
    ...{ 'a-C': 'Amorphous carbon', Hg: 'Mercury', HgTe: 'Mercury telluride', K: 'Potassium', Li: 'Lithium' },
    ...{ Na: 'Sodium', Se: 'Selenium', 'Se-e': 'Selenium, extraordinary', Te: 'Tellurium' },
    'Te-e': 'Tellurium, extraordinary',
  },
};

const DIELECTRICS = {
  Coats: { 'clear-coat': 'Clear coat', lacquer: 'Lacquer', oil: 'Oil', varnish: 'Varnish' },
  Plastics: {
    ...{ acrylic: 'Acrylic', pet: 'PET', polycarbonate: 'Polycarbonate', polypropylene: 'Polypropylene' },
    ...{ polystyrene: 'Polystyrene', polyurethane: 'Polyurethane' },
  },
  Glass: { bk7: 'Crown glass (BK7)', 'fused-silica': 'Fused silica', pyrex: 'Pyrex', sf11: 'Flint glass (SF11)' },
  'Liquids and air': { air: 'Air', ethanol: 'Ethanol', glycerol: 'Glycerol', water: 'Water' },
  'Crystals and minerals': {
    ...{ amber: 'Amber', CsI: 'Caesium iodide', diamond: 'Diamond', ice: 'Ice', MgO: 'Magnesium oxide' },
    ...{ rutile: 'Rutile', 'TiO2-e': 'Rutile, extraordinary', salt: 'Salt', sapphire: 'Sapphire' },
    ...{ SiC: 'Silicon carbide', ThF4: 'Thorium fluoride' },
  },
};

const PALIK = '_palik'; // the same substance, as Palik's handbook has it: for those that have no other numbers

/**
 * Groups of a menu, each in the order of its words: those of `known`, of which one in other words for the same is left
 * out, those that no words are of, and at last the measured pages.
 */
function grouped(groups, known, pages) {
  const sorted = (options) => options.sort(([, a], [, b]) => a.localeCompare(b));
  const nameOf = (name) => [name, name + PALIK].find((each) => Object.hasOwn(known, each));
  const options = (words) => sorted(Object.entries(words).map(([name, title]) => [nameOf(name), title])).filter(([name]) => name);
  const found = Object.entries(groups).map(([group, words]) => ({ group, options: options(words) }));
  const listed = found.flatMap(({ options }) => options.map(([name]) => name));
  const values = new Set(listed.map((name) => JSON.stringify(known[name])));
  const isOther = (name) => !nameIn(listed, name) && !values.has(JSON.stringify(known[name]));
  const others = { group: 'Others', options: Object.keys(known).filter(isOther) };
  const measured = { group: 'refractiveindex.info', options: sorted(pages.map(([name, { title }]) => [name, title])) };
  return [...found, others, measured].filter(({ options }) => options.length);
}

/** Whether a menu lists a name, or the same substance by one. */
const nameIn = (listed, name) => listed.includes(name) || listed.includes(name.replace(PALIK, ''));

const pagesOf = (names, opaque) => Object.entries(names.pages).filter(([, page]) => page.opaque === opaque);

/** A function of all names that is worked out once for them. */
function once(make) {
  const made = new WeakMap();
  return (names) => {
    if (!made.has(names)) made.set(names, make(names));
    return made.get(names);
  };
}

/** The groups of a menu of metals; a name that only stands for one of them is left out. */
export const metals = once((names) => grouped(METALS, names.conductors, pagesOf(names, true)));

/** The same for dielectrics. */
export const dielectrics = once((names) => grouped(DIELECTRICS, names.dielectrics, pagesOf(names, false)));

/** The option of a menu for a chosen `name` that none of its groups has, as a list. */
export function chosen(name, groups) {
  const listed = groups.some(({ options }) => options.some((option) => [option].flat()[0] === name));
  return listed || !name ? [] : [name];
}
