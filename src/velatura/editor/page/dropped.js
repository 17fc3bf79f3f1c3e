// What is dropped on the page: files, also of folders, and a material's file with the images that it names.

const MOST = 256; // files of a drop
const DEEPEST = 8; // folders in one another

/** Files of a drop with their paths, `[{file, path}]`, those of folders among them. Throws Error where there are too many. */
export async function filesOf({ items, files }) {
  const entries = [...(items ?? [])].map((item) => item.webkitGetAsEntry?.()); // all at once: a drop is gone after its event
  if (!entries.some((entry) => entry?.isDirectory)) return [...files].map((file) => ({ file, path: file.name }));
  const found = [];
  for (const entry of entries) if (entry) await walk(entry, '', 0, found);
  return found;
}

async function walk(entry, folder, depth, found) {
  const path = folder + entry.name;
  if (!entry.isDirectory) {
    if (found.length >= MOST) throw new Error(`a drop may hold ${MOST} files at most`);
    found.push({ file: await new Promise((resolve, reject) => entry.file(resolve, reject)), path });
    return;
  }
  if (depth >= DEEPEST) throw new Error(`${path}: folders may lie ${DEEPEST} deep at most`);
  const reader = entry.createReader();
  for (let some; (some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject))).length;)
    for (const each of some) await walk(each, `${path}/`, depth + 1, found); // they come in portions
}

const last = (path) => path.split('/').at(-1);

/**
 * The text of a material's file, at a `path`, in which images are called as they lie in the folder: `names` has them by the paths
 * that they were dropped with. An image that lies elsewhere is found by its name alone.
 */
export function withImages(text, path, names) {
  const folder = path.slice(0, path.length - last(path).length);
  const byName = new Map([...names].map(([dropped, name]) => [last(dropped), name]));
  const nameOf = (written) => names.get(folder + written.replace(/^\.\//, '')) ?? byName.get(last(written));
  return /\.gltf$/i.test(path) ? inGltf(text, nameOf) : inXml(text, nameOf);
}

function inGltf(text, nameOf) {
  const document = JSON.parse(text);
  const images = (document.images ?? []).map((image) => {
    const name = typeof image.uri === 'string' && !image.uri.startsWith('data:') ? nameOf(decodeURIComponent(image.uri)) : undefined;
    return name === undefined ? image : { ...image, uri: encodeURIComponent(name) };
  });
  return JSON.stringify(document.images ? { ...document, images } : document);
}

/** Of MaterialX, whose prefixes of files are in the names then, and of Mitsuba. */
function inXml(text, nameOf) {
  let found = false;
  const put = (all, begin, written) => {
    const name = nameOf(written);
    found ||= name !== undefined;
    return name === undefined ? all : `${begin}${name.replace(/&/g, '&amp;').replace(/</g, '&lt;').replace(/"/g, '&quot;')}"`;
  };
  const changed = text.replace(/(\bvalue=")([^"]+)"/g, put);
  return found ? changed.replace(/\sfileprefix="[^"]*"/g, '') : text;
}
