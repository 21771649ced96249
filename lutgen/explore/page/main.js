// The page of `lutgen explore`: the picture first, then all that is about its model (session.js).

import { pictureOf } from "./picture.js";
import { GONE, Refusal, Server } from "./server.js";
import { byId, spaced, tell } from "./words.js";

const server = new Server();
server.gone = (sentence) => tell("dead", sentence);

/** Say what is shown. @param {import("./contract").Overview} overview */
function head(overview) {
  const sessions = overview.hours.length;
  byId("name").textContent = overview.name;
  document.title = `${overview.name} · lutgen explore`;
  const count = `${spaced(overview.readings)} readings at ${sessions} ${sessions === 1 ? "hour" : "hours"}`;
  byId("provenance").textContent = [count, overview.provenance].filter(Boolean).join(" · ");
  byId("provenance").title = overview.provenance;
  document.body.classList.toggle("simulated", overview.simulated);
}

try {
  // What draws is made while the server opens the readings.
  const picture = pictureOf(server);
  const overview = await server.open();
  head(overview);
  await picture.begin(overview);
  // Nothing is fitted until the page listens, nor is the rest loaded: the picture has the processors for itself.
  const { sessionOf } = await import("./session.js");
  await sessionOf(server, picture, head).begin(overview);
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
