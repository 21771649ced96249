// The page of `lutgen explore`: first the picture, then everything about its model (session.js).

import { pictureOf } from "./picture.js";
import { GONE, Refusal, Server } from "./server.js";
import { byId, spaced, tell } from "./words.js";

const server = new Server();
server.gone = (sentence) => tell("dead", sentence);

/** Write the page's heading: the readings and the model. @param {import("./contract").Overview} overview */
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
  // The viewer is created while the server opens the readings.
  const picture = pictureOf(server);
  const overview = await server.open();
  head(overview);
  await picture.begin(overview);
  // The picture comes first: the server fits only after the page listens, and the other modules are loaded later.
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
