// A bounded cache of the latest results.

/** A map that holds so many entries at most: those that were set or found latest. */
export class Recent {
  #most;
  #entries = new Map();

  constructor(most) {
    this.#most = most;
  }

  get size() {
    return this.#entries.size;
  }

  keys() {
    return this.#entries.keys();
  }

  get(key) {
    if (!this.#entries.has(key)) return undefined;
    const value = this.#entries.get(key);
    this.set(key, value);
    return value;
  }

  set(key, value) {
    this.#entries.delete(key);
    this.#entries.set(key, value);
    if (this.#entries.size > this.#most) this.#entries.delete(this.#entries.keys().next().value);
  }

  /** The promise of `make()` under this key, made once; one that fails is forgotten. */
  once(key, make) {
    const known = this.get(key);
    if (known) return known;
    const made = make();
    this.set(key, made);
    made.catch(() => this.#entries.get(key) === made && this.#entries.delete(key));
    return made;
  }
}
