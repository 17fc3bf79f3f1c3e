// What the viewport draws when, by a clock that the test turns.

import assert from 'node:assert/strict';
import { test } from 'node:test';

import { Bands, Schedule } from '../../src/velatura/editor/page/render/schedule.js';

/** A schedule whose state has changed at 1000 ms. */
function begun() {
  const schedule = new Schedule();
  schedule.change(1000);
  return schedule;
}

function preview(schedule, now, took = 10) {
  const drawing = schedule.beginPreview(now);
  schedule.endPreview(drawing, now + took);
  return drawing;
}

test('a change is previewed at once, and paths are traced when all is quiet', () => {
  const schedule = begun();
  assert.deepEqual(schedule.next(1000, 0), { act: 'preview' });
  preview(schedule, 1000, 10);
  preview(schedule, 1010, 10); // the first is coarse, for it is not known yet how long a fine one takes
  assert.equal(schedule.previewed, 1020);
  assert.deepEqual(schedule.next(1030, 0), { act: 'wait', milliseconds: 120 });
  assert.deepEqual(schedule.next(1150, 0), { act: 'trace' });
  schedule.change(1160);
  assert.equal(schedule.previewed, 0);
  assert.deepEqual(schedule.next(1160, 0), { act: 'preview' });
});

test('paths end with their number, or with their time', () => {
  const schedule = begun();
  preview(schedule, 1000);
  preview(schedule, 1010);
  schedule.budget = { samples: 16, milliseconds: Infinity };
  assert.equal(schedule.next(2000, 15).act, 'trace');
  assert.equal(schedule.next(2000, 16).act, 'wait');
  schedule.budget = { samples: 16, milliseconds: 500 };
  assert.equal(schedule.next(1500, 15).act, 'trace');
  assert.equal(schedule.next(1501, 15).act, 'wait');
});

test('while something is dragged only coarse previews are drawn, and a fine one when it is let go', () => {
  const schedule = begun();
  schedule.hold(true, 1000);
  assert.equal(preview(schedule, 1000).coarse, true);
  assert.equal(schedule.previewed, 1010);
  assert.equal(schedule.next(9000, 0).act, 'wait');
  assert.equal(schedule.idle, false);
  schedule.hold(false, 9000);
  assert.equal(schedule.next(9000, 0).act, 'preview');
  assert.equal(preview(schedule, 9000).coarse, true); // how long a fine one takes is still not known
  assert.equal(preview(schedule, 9010).coarse, false);
  assert.equal(schedule.idle, true);
});

test('a coarse preview comes first only where a fine one takes long', () => {
  const schedule = begun();
  const coarse = (took) => {
    schedule.change(2000);
    const first = preview(schedule, 2000, took).coarse;
    if (first) preview(schedule, 2000, took);
    return first;
  };
  assert.equal(coarse(30), true);
  assert.equal(coarse(150), false);
  assert.equal(coarse(30), true);
  assert.equal(coarse(30), false);
});

test('a preview of a state that has gone counts as a frame and as nothing else', () => {
  const schedule = begun();
  const drawing = schedule.beginPreview(1000);
  schedule.change(1005);
  schedule.endPreview(drawing, 1010);
  assert.equal(schedule.previewed, 0);
  assert.deepEqual(schedule.frames, [1010]);
});

test('frames per second are those of the last second with any', () => {
  const schedule = new Schedule();
  assert.equal(schedule.framesPerSecond, 0);
  schedule.frames = [100, 5000, 5100, 5200, 5300];
  assert.equal(schedule.framesPerSecond, 10);
});

test('plots wait until the preview has rested', () => {
  const schedule = begun();
  assert.equal(schedule.rested(200, 9000), false);
  preview(schedule, 1000);
  preview(schedule, 1010);
  assert.equal(schedule.rested(200, 1220), false);
  assert.equal(schedule.rested(200, 1221), true);
});

/** The bands of one slice, and how many samples of the picture they complete. */
function slice(bands, height) {
  const found = [];
  let samples = 0;
  let rows = 0;
  for (let band; (band = bands.next(height, rows)); ) {
    found.push([band.first, band.end]);
    rows += band.end - band.first;
    if (bands.advance(band, height)) samples++;
  }
  return { found, rows, samples };
}

test('the bands of a sample cover every row once', () => {
  for (const height of [1, 7, 8, 9, 100]) {
    const bands = new Bands();
    const seen = [];
    for (let rows = 0, done = false; !done; ) {
      const band = bands.next(height, rows);
      if (!band) {
        rows = 0; // another slice
        continue;
      }
      for (let y = band.first; y < band.end; y++) seen.push(y);
      rows += band.end - band.first;
      done = bands.advance(band, height);
    }
    assert.deepEqual(seen, [...Array(height).keys()]);
  }
});

test('slices grow on a quick device, shrink on a slow one, and are bounded', () => {
  const bands = new Bands();
  const rows = () => slice(bands, 100).rows;
  bands.pace(50, 40, 100);
  bands.restart();
  assert.equal(rows(), 50);
  bands.pace(50, 1, 100); // at most doubled
  bands.restart();
  assert.equal(rows(), 100);
  bands.pace(8, 4000, 100); // at most quartered
  bands.restart();
  assert.equal(rows(), 2);
  bands.pace(100_000, 40, 100);
  bands.restart();
  assert.deepEqual([slice(bands, 100).rows, slice(bands, 100).samples], [6400, 64]);
});

test('blocks of pixels grow while previews of what is dragged take long, two in a row, and are small again after it', () => {
  const schedule = begun();
  schedule.hold(true, 1000);
  const blocks = [90, 40, 90, 90, 90, 90, 90, 90, 90].map((took) => preview(schedule, 1000, took).block);
  assert.deepEqual(blocks, [2, 2, 2, 2, 3, 3, 4, 4, 4]);
  schedule.hold(false, 2000);
  assert.equal(preview(schedule, 2000, 90).block, 2);
  assert.equal(preview(schedule, 2010, 90).block, 1);
});
