// Downloads: files of the shown state, and the commands that make the same files.

import { trying } from "./server.js";
import { byId, element, input, save, spaced, tell } from "./words.js";

/** Files to download: the server's name → the button. */
const FILES = {
  model: "Model (.toml)",
  cube: "This hour (.cube)",
  clf: "This hour (.clf)",
  icc: "This hour (.icc)",
  build: "All hours, with OCIO config (.zip)",
  report: "Report (.html)",
  patches: "What to measure next (.csv)",
  readings: "Campaign (.toml)",
};

/**
 * @param {import("./server.js").Server} server
 * @param {{shown: () => {mode: string, hours: number}, error: () => import("./contract").ModelError | undefined}} page
 */
export function takeOf(server, page) {
  const kind = input("take-kind");
  /** @type {import("./contract").Support | null} */
  let support = null;

  /** @param {string} what @param {HTMLButtonElement} button */
  const take = async (what, button) => {
    const { mode, hours } = page.shown();
    byId("take-state").textContent = `Making the file, ${mode} at ${spaced(hours)} h …`;
    const making = new AbortController();
    const cancel = byId("take-cancel");
    cancel.onclick = () => making.abort();
    button.disabled = true;
    cancel.hidden = false;
    const taken = await trying("take-trouble", async () => {
      const address = server.address("take", { what, mode, hours, kind: kind.value });
      const response = await server.fetch(address, { signal: making.signal });
      cancel.hidden = true;
      const named = /filename="?([^";]+)/.exec(response.headers.get("Content-Disposition") ?? "");
      const name = named?.[1] ?? `lutgen.${what}`;
      const blob = await response.blob();
      save(blob, name);
      byId("take-state").textContent = `${name}, ${spaced(Math.max(blob.size / 1000, 1))} kB`;
    });
    if (!taken) byId("take-state").textContent = "";
    cancel.hidden = true;
    button.disabled = false;
    button.focus();
  };

  byId("take-files").append(
    ...Object.entries(FILES).map(([what, words]) => {
      const button = element("button", { type: "button", id: `take-${what}` }, words);
      button.addEventListener("click", () => take(what, button));
      return button;
    }),
  );

  /** @param {import("./contract").Command} command */
  const line = ({ words, command }) => {
    const copy = element("button", { type: "button", "aria-label": `Copy: ${command}` }, "Copy");
    copy.addEventListener("click", async () => {
      await navigator.clipboard.writeText(command);
      copy.textContent = "Copied";
    });
    // A line is never broken within an option or a name.
    const parts = command.split(/(?<= )/).map((each) => element("i", {}, each));
    return element("li", {}, element("span", {}, words), element("code", {}, ...parts), copy);
  };

  const commands = async () => {
    const doubtful = page.error()?.effects.filter((each) => !each.supported) ?? [];
    const said = doubtful.map((each) => each.said);
    if (!said.length && support?.keep) said.push(support.sentence);
    if (page.error()?.what_if) said.push("Files and commands are of the fit: they do not include “what if” values.");
    tell("take-warning", said.join(" "));
    await trying("take-trouble", async () => {
      /** @type {import("./contract").Command[]} */
      const listed = await server.get("commands", { ...page.shown(), kind: kind.value });
      byId("commands").replaceChildren(...listed.map(line));
    });
  };

  byId("take").addEventListener("beforetoggle", (event) => {
    if (/** @type {ToggleEvent} */ (event).newState !== "open") return;
    byId("take-state").textContent = "";
    void commands();
  });

  const refresh = () => byId("take").matches(":popover-open") && void commands();
  kind.addEventListener("change", refresh);

  return {
    /** Another session has begun. @param {import("./contract").Overview} overview */
    begin({ written }) {
      support = null;
      byId("take-readings").hidden = !written;
      tell("take-written", written ? "The commands read campaign.toml: save it beside the sessions." : "");
    },
    /** The model has changed: update its commands if they are shown. */
    refresh() {
      if (page.error()?.provisional) support = null;
      refresh();
    },
    /** The test of the fit on withheld readings is done. @param {import("./contract").Support} next */
    support(next) {
      support = next;
      refresh();
    },
  };
}
