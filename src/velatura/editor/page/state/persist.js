// State that outlives a page: the history of this tab, the last material of any, the layout, pictures of
// earlier states, colours, and the files dropped on them.

const TAB = 'velatura.tab';
const LAST = 'velatura.last';
const LAYOUT = 'velatura.layout';
const SNAPSHOTS = 'velatura.snapshots';
const SWATCHES = 'velatura.swatches';
const FORM = 1; // of what is stored; another one is not read

/** Storage of the browser: a tab has its own history, and a new one begins with the last material of any. */
export function browserStorage({ sessionStorage, localStorage, indexedDB }) {
  return {
    load: () => read(sessionStorage, TAB),
    last: () => read(localStorage, LAST),
    save({ present, past, future }) {
      write(localStorage, LAST, present);
      // Forget the oldest steps where there is no room for all
      for (let steps = past; !write(sessionStorage, TAB, { present, past: steps, future });) {
        if (!steps.length) return;
        steps = steps.slice(Math.ceil(steps.length / 2));
      }
    },
    layout: () => read(localStorage, LAYOUT),
    keepLayout: (layout) => write(localStorage, LAYOUT, layout),
    snapshots: () => read(sessionStorage, SNAPSHOTS) ?? [],
    keepSnapshots: (list) => write(sessionStorage, SNAPSHOTS, list),
    swatches: () => read(localStorage, SWATCHES),
    keepSwatches: (list) => write(localStorage, SWATCHES, list),
    put: (name, file) => inStore(indexedDB, 'readwrite', (store) => store.put(file, name)),
    get: (name) => inStore(indexedDB, 'readonly', (store) => store.get(name)),
  };
}

/** Storage that ends with the page. */
export function memoryStorage() {
  const files = new Map();
  return {
    load: () => null,
    last: () => null,
    save() {},
    layout: () => null,
    keepLayout() {},
    snapshots: () => [],
    keepSnapshots() {},
    swatches: () => null,
    keepSwatches() {},
    put: async (name, file) => void files.set(name, file),
    get: async (name) => files.get(name),
  };
}

function read(storage, key) {
  try {
    const { form, value } = JSON.parse(storage.getItem(key));
    return form === FORM ? value : null;
  } catch {
    return null;
  }
}

function write(storage, key, value) {
  try {
    storage.setItem(key, JSON.stringify({ form: FORM, value }));
    return true;
  } catch {
    return false;
  }
}

function inStore(indexedDB, mode, use) {
  return new Promise((resolve, reject) => {
    const opening = indexedDB.open('velatura', 1);
    opening.onupgradeneeded = () => opening.result.createObjectStore('files');
    opening.onerror = () => reject(opening.error);
    opening.onsuccess = () => {
      const request = use(opening.result.transaction('files', mode).objectStore('files'));
      request.onerror = () => reject(request.error);
      request.onsuccess = () => resolve(request.result);
    };
  });
}
