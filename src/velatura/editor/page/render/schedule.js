// The order of drawing: a preview at once after a change, then paths in slices of time, until there are enough.
// Times are in milliseconds, of the clock that gives `now`.

const QUIET = 150; // without a change, after which paths are traced
const SLOW = 100; // for a preview, from which on a coarse one comes before it
const LOOK = 1000; // until the next look where nothing is to be done
const SLICE = 40; // that the device may be busy without a break
const MOST_SAMPLES = 64; // in a slice, however quick they are
const FRAMES = 100; // that are remembered
const BLOCKS = [2, 4]; // pixels along both axes that are one in a coarse preview: at first, and at most
const FLUENT = 50; // for a coarse preview, from which on the next ones have larger blocks while something is dragged

export class Schedule {
  held = false; // whether something is being dragged
  budget = { samples: 1024, milliseconds: Infinity };
  previewed = 0; // since when the preview shows the present state; 0 where it does not yet
  frames = []; // when previews were there
  #coarse = false; // whether a coarse preview shows the present state
  #fineTook = Infinity; // the last preview with all pixels
  #block = BLOCKS[0];
  #slow = 0; // coarse previews in a row that took long
  #drawing = null; // the preview on its way, unless it is of a state that has gone
  #touched = 0; // when a value, or the hand on it, last changed
  #changed = 0; // when the state last changed

  /** The state is another one now. */
  change(now) {
    this.outdate();
    this.#touched = this.#changed = now;
  }

  /** Requests another preview of the same state. */
  outdate() {
    this.previewed = 0;
    this.#coarse = false;
    this.#drawing = null;
  }

  /** Something is dragged from now on, or no more. */
  hold(held, now) {
    if (this.held && !held) this.outdate();
    if (this.held !== held) this.#setBlock(BLOCKS[0]);
    this.held = held;
    this.#touched = now;
  }

  /** The next action at a number of samples: {act: 'preview' | 'trace' | 'wait', milliseconds}. */
  next(now, samples) {
    if (!this.previewed) return { act: 'preview' };
    if (this.held) return { act: 'wait', milliseconds: LOOK };
    const quiet = now - this.#touched;
    if (quiet < QUIET) return { act: 'wait', milliseconds: QUIET - quiet };
    const isEnough = samples >= this.budget.samples || now - this.#changed > this.budget.milliseconds;
    return isEnough ? { act: 'wait', milliseconds: LOOK } : { act: 'trace' };
  }

  /**
   * Begins a preview: `coarse` while something is dragged, and at first where the last fine one took long. A `block` of
   * its pixels, along both axes, is one.
   */
  beginPreview(now) {
    const coarse = this.held || (!this.#coarse && this.#fineTook > SLOW);
    this.#drawing = { coarse, block: coarse ? this.#block : 1, begun: now };
    return this.#drawing;
  }

  endPreview(drawing, now) {
    const took = now - drawing.begun;
    if (drawing.coarse) this.#pace(took);
    else this.#fineTook = took;
    this.frames = [...this.frames.slice(-FRAMES), now];
    if (this.#drawing !== drawing) return; // the state has changed meanwhile
    this.#coarse = drawing.coarse && !this.held;
    this.previewed = this.#coarse ? 0 : now;
  }

  /** Takes larger blocks where two coarse previews have taken long, one after the other. */
  #pace(took) {
    this.#slow = took > FLUENT ? this.#slow + 1 : 0;
    if (this.held && this.#slow > 1 && this.#block < BLOCKS[1]) this.#setBlock(this.#block + 1);
  }

  #setBlock(block) {
    this.#block = block;
    this.#slow = 0;
  }

  /** Whether there is nothing to do but to trace paths. */
  get idle() {
    return this.previewed > 0 && !this.held && this.budget.samples > 0;
  }

  /** Whether the preview has shown the present state for that long. */
  rested(milliseconds, now) {
    return this.previewed > 0 && now - this.previewed > milliseconds;
  }

  /** Of previews, over the last second in which there were any. */
  get framesPerSecond() {
    const last = this.frames.at(-1);
    const recent = this.frames.filter((time) => time > last - 1000);
    return recent.length < 2 ? 0 : (1000 * (recent.length - 1)) / (last - recent[0]);
  }
}

/** Divides samples into bands of rows, as many in a slice as the device gets done in its time. */
export class Bands {
  #rows = 8; // of a slice
  #first = 0; // row of the next band

  /** The next band {first, end} of a picture, in a slice that has so many rows already; null where it is full. */
  next(height, rows) {
    if (rows >= this.#rows) return null;
    const left = height - this.#first;
    const parts = Math.ceil(left / (this.#rows - rows));
    return { first: this.#first, end: this.#first + Math.ceil(left / parts) };
  }

  /** A band is drawn; whether a sample of the whole picture is. */
  advance({ end }, height) {
    this.#first = end % height;
    return this.#first === 0;
  }

  /** Begins a sample anew. */
  restart() {
    this.#first = 0;
  }

  /** Takes more rows into the next slice, or fewer, after some have taken so many milliseconds. */
  pace(rows, took, height) {
    const scale = Math.min(Math.max(SLICE / Math.max(took, 1), 0.25), 2);
    this.#rows = Math.min(Math.max(Math.round(rows * scale), 1), MOST_SAMPLES * height);
  }
}
