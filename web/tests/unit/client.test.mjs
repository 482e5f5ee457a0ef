// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Newest } from '../../src/live/client.js';

test('of many wanted revisions only the running and the last are fetched, one at a time', async () => {
  const fetched = [];
  let running = 0;
  let finish;
  const newest = new Newest(async (revision) => {
    assert.equal(++running, 1);
    fetched.push(revision);
    await new Promise((resolve) => { finish = resolve; });
    --running;
  });
  const all = newest.want(1);
  for (let revision = 2; revision <= 50; ++revision) newest.want(revision);
  finish();
  await new Promise((resolve) => setImmediate(resolve));
  finish();
  await all;
  assert.deepEqual(fetched, [1, 50]);
});

test('after a connection was lost the same number is fetched again', async () => {
  const fetched = [];
  const newest = new Newest(async (revision) => fetched.push(revision));
  await newest.want(3);
  await newest.want(3);
  assert.deepEqual(fetched, [3]);
  newest.forget();
  await newest.want(3);
  assert.deepEqual(fetched, [3, 3]);
});

test('a failed request is tried again', async () => {
  let calls = 0;
  const newest = new Newest(async () => { if (++calls < 3) throw new Error('no network'); });
  await newest.want(7);
  assert.equal(calls, 3);
});
