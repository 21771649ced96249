// Everything about the model of the open readings: error, physics, dropped files and downloads.

import { dropOf } from "./drop.js";
import { errorOf } from "./error.js";
import { physicsOf } from "./physics.js";
import { takeOf } from "./take.js";

/**
 * @param {import("./server.js").Server} server
 * @param {ReturnType<typeof import("./picture.js").pictureOf>} picture
 * @param {(overview: import("./contract").Overview) => void} head writes the page's heading
 */
export function sessionOf(server, picture, head) {
  const error = errorOf();

  /** Number of the last switch request whose error is shown, and whether this error is of the fit. */
  let answered = { number: 0, fitted: false };

  /** @param {import("./contract").ModelError} next */
  const show = (next) => {
    const late =
      next.switch < answered.number || (next.provisional && next.switch === answered.number && answered.fitted);
    if (late) return;
    answered = { number: next.switch, fitted: !next.provisional };
    physics.parameters(error.show(next));
    picture.refresh(next);
    take.refresh();
  };

  /** Show other readings, or the same readings under another model. @param {import("./contract").Overview} overview */
  const again = async (overview) => {
    head(overview);
    await Promise.all([picture.begin(overview), begin(overview)]);
  };

  const physics = physicsOf(server, { error: show, begin: again });
  const take = takeOf(server, { shown: picture.shown, error: () => error.now });
  dropOf(server, { begin: again, image: picture.take, own: physics.own });
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

  /** Begin with readings whose picture is shown. @param {import("./contract").Overview} overview */
  const begin = async (overview) => {
    error.forget();
    take.begin(overview);
    await physics.begin(overview);
    // An error that came before these readings was reset together with the previous readings' error.
    const { error: missed } = error.now ? { error: null } : await server.get("overview");
    if (missed && !error.now) show(missed);
  };
  return { begin };
}
