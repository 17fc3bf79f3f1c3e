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
    ...{ 'd-C_palik': 'Diamond (Palik)', TiO2_palik: 'Rutile (Palik)' },
  },
};

const PALIK = '_palik'; // the same substance, as Palik's handbook has it

/** Groups of a menu, each in the order of its words; the last has the names of `known` for which there are none. */
function grouped(groups, known) {
  const options = (words) =>
    Object.entries(words)
      .flatMap(([name, title]) => [
        [name, title],
        [name + PALIK, `${title} (Palik)`],
      ])
      .filter(([name]) => name in known)
      .sort(([, a], [, b]) => a.localeCompare(b));
  const found = Object.entries(groups).map(([group, words]) => ({ group, options: options(words) }));
  const listed = found.flatMap(({ options }) => options.map(([name]) => name));
  const values = new Set(listed.map((name) => JSON.stringify(known[name])));
  const isOther = (name) => !listed.includes(name) && !values.has(JSON.stringify(known[name]));
  const others = { group: 'Others', options: Object.keys(known).filter(isOther) };
  return [...found, others].filter(({ options }) => options.length);
}

/** The groups of a menu of metals; a name that only stands for one of them is left out. */
export const metals = (names) => grouped(METALS, names.conductors);

/** The same for dielectrics. */
export const dielectrics = (names) => grouped(DIELECTRICS, names.dielectrics);

/** The option of a menu for a chosen `name` that none of its groups has, as a list. */
export function chosen(name, groups) {
  const listed = groups.some(({ options }) => options.some((option) => [option].flat()[0] === name));
  return listed || !name ? [] : [name];
}
