// The server of the page: requests of this window, its events, and the notice when the server has gone.

import { tell } from "./words.js";

export const GONE =
  "The server has ended, so nothing here answers any more. Start lutgen explore again; it opens a new page.";

/** A refused request, with the server's sentence. */
export class Refusal extends Error {}

/** Run a task; if the server refuses it, show the sentence in an element. Return whether the task succeeded. @param {string} id @param {() => Promise<unknown>} task */
export async function trying(id, task) {
  tell(id);
  try {
    await task();
    return true;
  } catch (error) {
    if (!(error instanceof Refusal)) throw error;
    tell(id, error.message);
    return false;
  }
}

export class Server {
  constructor() {
    this.window = "";
    /** Called with advice when the server or its window has gone, with "" when it is back. */
    this.gone = (/** @type {string} */ _sentence) => {};
    /** @type {EventSource | null} */
    this.source = null;
    /** @type {Record<string, number>} */
    this.limits = {};
  }

  /** Refuse, before sending, files that the server would refuse. @param {File[]} files @param {string} kind */
  check(files, kind) {
    const large = files.find((each) => each.size > this.limits[kind]);
    if (large)
      throw new Refusal(
        `${large.name} has ${Math.ceil(large.size / 1e6)} MB. At most ${this.limits[kind] / 1e6} MB are taken here; the command line takes more.`,
      );
  }

  /** The window whose data are at the end of the page. @returns {Promise<import("./contract").Overview>} */
  async open() {
    if (document.readyState === "loading")
      await new Promise((parsed) => document.addEventListener("DOMContentLoaded", parsed));
    const begins = document.getElementById("begins");
    if (!begins) throw new Refusal(GONE);
    const overview = JSON.parse(begins.textContent ?? "");
    if (overview.refused) throw new Refusal(overview.refused);
    this.window = overview.window;
    this.limits = overview.limits;
    return overview;
  }

  /** @param {string} what @param {Record<string, unknown>} query */
  address(what, query = {}) {
    const words = Object.entries({ window: this.window, ...query }).filter(([, value]) => value !== "");
    return `api/${what}?${new URLSearchParams(words.map(([name, value]) => [name, String(value)]))}`;
  }

  /** @param {string} address @param {RequestInit} [request] */
  async fetch(address, request) {
    let response;
    try {
      response = await fetch(address, request);
    } catch {
      if (request?.signal?.aborted) throw new Refusal("Cancelled.");
      this.gone(GONE);
      throw new Refusal("");
    }
    this.gone("");
    if (response.ok) return response;
    const refused = await response.json().catch(() => null);
    if (response.status === 410) this.gone(refused?.error);
    throw new Refusal(refused?.error ?? `The server answers ${response.status} ${response.statusText}.`);
  }

  /** @param {string} what @param {Record<string, unknown>} query */
  async get(what, query = {}) {
    return (await this.fetch(this.address(what, query))).json();
  }

  /** Send JSON, a file's bytes or a form. @param {string} what @param {unknown} [body] @param {Record<string, unknown>} query */
  async post(what, body, query = {}) {
    const raw = body instanceof Blob || body instanceof FormData;
    const request =
      raw || body === undefined
        ? { method: "POST", body: /** @type {BodyInit | undefined} */ (body) }
        : { method: "POST", body: JSON.stringify(body), headers: { "Content-Type": "application/json" } };
    return (await this.fetch(this.address(what, query), request)).json();
  }

  /** A table for the viewer. @param {Record<string, unknown>} query @returns {Promise<import("./viewer.js").Table>} */
  async table(query) {
    const response = await this.fetch(this.address("table", query));
    const size = Number(response.headers.get("X-Lutgen-Size"));
    return { size, values: new Uint16Array(await response.arrayBuffer()), differences: Boolean(query.map) };
  }

  /** Call the listeners on the server's events, by the events' names. @param {Record<string, (content: any) => void>} listeners */
  listen(listeners) {
    this.source?.close();
    this.source = new EventSource(this.address("events"));
    for (const [name, listener] of Object.entries(listeners)) {
      // An "error" without data is the browser's own event: the connection was lost.
      this.source.addEventListener(name, (event) => {
        if (event instanceof MessageEvent) listener(JSON.parse(event.data));
      });
    }
    this.source.addEventListener("error", (event) => {
      if (!(event instanceof MessageEvent)) this.get("overview").catch(() => {});
    });
    this.source.addEventListener("open", () => this.gone(""));
  }
}

/**
 * Run one request at a time, and after it only the latest of the requests that came meanwhile: a slider sends requests
 * faster than the server answers.
 * @template A @param {(asked: A) => Promise<void>} task
 */
export function latest(task) {
  let running = false;
  /** @type {{asked: A} | null} */
  let next = null;
  return async (/** @type {A} */ asked) => {
    next = { asked };
    if (running) return;
    running = true;
    try {
      while (next) {
        const { asked: now } = next;
        next = null;
        await task(now);
      }
    } finally {
      running = false;
    }
  };
}
