// The page's entry: connects to the server, or to the files beside the page; mounts the editor, restores the last state.

import { mount } from './app.js';
import { call, liveConnection } from './connection.js';
import './editor.css';
import { connectFiles } from './offline.js';
import { browserStorage } from './state/persist.js';
import { isShared } from './state/share.js';

try {
  const { answers } = document.documentElement.dataset; // where they lie in files
  const client = answers ? await connectFiles(answers) : { call };
  const session = await client.call('session');
  const live = answers ? null : liveConnection(`ws://${location.host}/api/live`);
  window.velatura = mount(document.body, {
    ...{ ...client, live, session, storage: browserStorage(window) },
    address: location.origin + location.pathname,
  });
  openAddress();
  window.addEventListener('hashchange', openAddress);
} catch (error) {
  const words = Object.assign(document.createElement('p'), {
    textContent: `The editor cannot start: ${error.message}`,
  });
  words.setAttribute('role', 'alert');
  document.body.replaceChildren(words);
}

/** Opens what the address holds; then it is taken out of it, so that a later reload keeps what has changed. */
function openAddress() {
  const { hash, pathname } = location;
  if (!isShared(hash)) return;
  history.replaceState(null, '', pathname);
  window.velatura.openShared(hash);
}
