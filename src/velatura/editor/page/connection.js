// Talking to the server: calls over HTTP, and a WebSocket that shows whether it is there.

/** An error that the user can mend, in one line; `status` 409 is a conflict. */
export class Refused extends Error {
  constructor(message, status) {
    super(message);
    this.status = status;
  }
}

/** The server does not answer. */
export class Offline extends Error {
  constructor() {
    super('The server does not answer.');
  }
}

/** Calls a verb of the server. */
export async function call(verb, body = {}) {
  const request = {
    method: 'POST',
    headers: { 'Content-Type': 'application/json' },
    body: JSON.stringify(body),
  };
  const response = await fetch(`/api/${verb}`, request).catch(() => {
    throw new Offline();
  });
  const answer = await response.json().catch(() => ({}));
  if (response.ok) return answer;
  throw new Refused(answer.error ?? `The server failed (${verb}: ${response.status}).`, response.status);
}

const SHORTEST = 250; // milliseconds between two tries to connect
const LONGEST = 4000;

/** `ask(verb, body)` by a function that sends: of each verb one at a time, and of those that wait the latest alone. */
export function latest(send) {
  const waiting = new Map(); // verb -> {body, resolve, reject} not sent yet
  const busy = new Set(); // verbs

  async function work(verb) {
    busy.add(verb);
    for (let next; (next = waiting.get(verb));) {
      waiting.delete(verb);
      await send(verb, next.body).then(next.resolve, next.reject);
    }
    busy.delete(verb);
  }

  /** The answer, or null where a later question of the same verb took its place. */
  return (verb, body) =>
    new Promise((resolve, reject) => {
      waiting.get(verb)?.resolve(null);
      waiting.set(verb, { body, resolve, reject });
      if (!busy.has(verb)) work(verb);
    });
}

/** The line that is kept open: `online`, `onChange(f)`, and `ask(verb, body)` of `latest`. */
export function liveConnection(address) {
  const listeners = new Set();
  const sent = new Map(); // id -> {resolve, reject}
  let socket = null;
  let pause = SHORTEST;
  let count = 0;
  let timer = null;

  function become(online) {
    if (connection.online === online) return;
    connection.online = online;
    for (const listener of listeners) listener(online);
  }

  function open() {
    socket = new WebSocket(address);
    socket.onopen = () => {
      pause = SHORTEST;
      become(true);
    };
    socket.onmessage = ({ data }) => settle(JSON.parse(data));
    socket.onclose = () => {
      become(false);
      for (const { reject } of sent.values()) reject(new Offline());
      sent.clear();
      timer = setTimeout(open, pause);
      pause = Math.min(2 * pause, LONGEST);
    };
  }

  function settle({ id, answer, error }) {
    const { resolve, reject } = sent.get(id);
    sent.delete(id);
    if (error === undefined) resolve(answer);
    else reject(new Refused(error, 422));
  }

  async function send(verb, body) {
    if (!connection.online) throw new Offline();
    socket.send(JSON.stringify({ id: ++count, verb, body }));
    return new Promise((resolve, reject) => sent.set(count, { resolve, reject }));
  }

  const connection = {
    online: null, // not known yet
    onChange(listener) {
      listeners.add(listener);
      return () => listeners.delete(listener);
    },
    ask: latest(send),
    close() {
      clearTimeout(timer);
      if (!socket) return;
      socket.onclose = null;
      socket.close();
    },
  };
  open();
  return connection;
}
