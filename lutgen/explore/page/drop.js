// Files from the user, dropped anywhere, pasted, or chosen: readings, an image, or an effect.

import { trying } from "./server.js";
import { byId, element, input } from "./words.js";

const SESSIONS = /\.(csv|ti3|toml)$/i;
const PROGRAM = /\.py$/i;

/**
 * @param {import("./server.js").Server} server
 * @param {{begin: (overview: import("./contract").Overview) => Promise<void>, image: (file: File) => Promise<void>, own: (file: File) => void}} page
 */
export function dropOf(server, page) {
  const panel = byId("drop");
  const form = /** @type {HTMLFormElement} */ (byId("drop-hours"));

  const same = byId("drop-same");

  /** @param {File[]} files @param {{hours?: string, same?: string}} told what only the user knows of the files */
  const open = async (files, told = {}) => {
    panel.showPopover();
    same.hidden = true;
    if (!told.hours) form.hidden = true;
    byId("drop-state").textContent = `Reading ${files.map((each) => each.name).join(", ")} …`;
    await trying("drop-trouble", async () => {
      const answer = await sent(server, files, told);
      if ("needs_hours" in answer) return ask(files, answer.needs_hours, told);
      form.hidden = true;
      await page.begin(answer);
      panel.hidePopover();
    });
    byId("drop-state").textContent = "";
    // The command line's message names a remedy, which is a button here.
    same.hidden = !byId("drop-trouble").textContent?.includes("--same-display");
    same.onclick = () => open(files, { same: "yes" });
  };

  /** Ask for the hours of sessions. @param {File[]} files @param {import("./contract").NeededHours["needs_hours"]} needed @param {{same?: string}} told */
  const ask = (files, needed, told) => {
    const fields = needed.map(({ name, dated }, place) => {
      const field = element("input", {
        type: "number",
        min: "0",
        step: "any",
        required: "",
        id: `hours-of-${place}`,
        name,
      });
      return element(
        "div",
        {},
        element("label", { for: field.id }, name, element("small", {}, dated ? `measured ${dated}` : "")),
        field,
        " h",
      );
    });
    form.replaceChildren(
      element("p", {}, "At which operating hours was each session measured?"),
      ...fields,
      element("button", { class: "main" }, "Open"),
    );
    form.hidden = false;
    form.querySelector("input")?.focus();
    form.onsubmit = (event) => {
      event.preventDefault();
      const hours = [...form.querySelectorAll("input")].map((each) => each.value).join(",");
      void open(files, { ...told, hours });
    };
  };

  /** @param {File[]} files */
  const take = async (files) => {
    const sessions = files.filter((each) => SESSIONS.test(each.name));
    const program = files.find((each) => PROGRAM.test(each.name));
    const image = files.find((each) => !SESSIONS.test(each.name) && !PROGRAM.test(each.name));
    if (sessions.length) await open(sessions);
    if (image) await page.image(image);
    if (program) page.own(program);
  };

  input("drop-files").addEventListener("change", async () => {
    const files = [...(input("drop-files").files ?? [])];
    input("drop-files").value = "";
    if (files.length) await open(files);
  });
  input("image").addEventListener("change", async () => {
    const file = input("image").files?.[0];
    input("image").value = "";
    if (file) await page.image(file);
  });

  const here = byId("drop-here");
  addEventListener("dragover", (event) => {
    event.preventDefault();
    here.hidden = !event.dataTransfer?.types.includes("Files");
  });
  addEventListener("dragleave", (event) => {
    if (!event.relatedTarget) here.hidden = true;
  });
  addEventListener("drop", (event) => {
    event.preventDefault();
    here.hidden = true;
    void take([...(event.dataTransfer?.files ?? [])]);
  });
  addEventListener("paste", (event) => {
    const files = [...(event.clipboardData?.files ?? [])];
    if (!files.length) return;
    event.preventDefault();
    void take(files);
  });
}

/**
 * Send files one after the other, or the hours of files that were sent before.
 * @param {import("./server.js").Server} server @param {File[]} files @param {{hours?: string, same?: string}} told
 */
async function sent(server, files, told) {
  if (told.hours) return server.post("drop", undefined, told);
  server.check(files, "readings");
  for (const file of files.slice(0, -1)) await server.post("drop", file, { name: file.name, more: 1 });
  const last = files[files.length - 1];
  return server.post("drop", last, { name: last.name, ...told });
}
