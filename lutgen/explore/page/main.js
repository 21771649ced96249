// The page of `lutgen explore`: a window of the server, and the parts that share it.

import { dropOf } from "./drop.js";
import { errorOf } from "./error.js";
import { physicsOf } from "./physics.js";
import { pictureOf } from "./picture.js";
import { GONE, Refusal, Server } from "./server.js";
import { takeOf } from "./take.js";
import { byId, spaced, tell } from "./words.js";

const server = new Server();
server.gone = (sentence) => tell("dead", sentence);
// The server prepares the window while the page does.
const opening = server.open();
const error = errorOf();

/** @param {import("./contract").ModelError} next */
const show = (next) => {
  error.show(next);
  physics.parameters(next);
  picture.refresh();
  take.refresh();
};

const physics = physicsOf(server, { error: show, begin });

/** @type {ReturnType<typeof pictureOf>} */
let picture;
/** @type {ReturnType<typeof takeOf>} */
let take;

/** Show a session from its beginning. @param {import("./contract").Overview} overview */
async function begin(overview) {
  const sessions = overview.hours.length;
  byId("name").textContent = overview.name;
  document.title = `${overview.name} · lutgen explore`;
  const count = `${spaced(overview.readings)} readings at ${sessions} ${sessions === 1 ? "hour" : "hours"}`;
  byId("provenance").textContent = [count, overview.provenance].filter(Boolean).join(" · ");
  byId("provenance").title = overview.provenance;
  document.body.classList.toggle("simulated", overview.simulated);
  error.forget();
  await Promise.all([picture.begin(overview), physics.begin(overview)]);
  if (overview.error) show(overview.error);
}

try {
  picture = pictureOf(server);
  take = takeOf(server, { shown: picture.shown, error: () => error.now });
  dropOf(server, { begin, image: picture.take, own: physics.own });
  const overview = await opening;
  server.listen({
    error: show,
    effects: (list) => {
      physics.effects(list);
      if (error.now) physics.parameters(error.now);
    },
    support: take.support,
    image: picture.note,
    measured: picture.measure,
    progress: physics.progress,
    verdict: physics.verdict,
    failed: (content) => physics.failed(content.error),
    ended: physics.ended,
  });
  await begin(overview);
  document.body.dataset.ready = "yes";
} catch (trouble) {
  tell(
    "dead",
    trouble instanceof Refusal && !trouble.message
      ? GONE
      : trouble instanceof Error
        ? trouble.message
        : String(trouble),
  );
  if (!(trouble instanceof Refusal)) throw trouble;
}
