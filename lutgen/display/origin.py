"""Where an effect came from, as model files and manifests say it, and how it is found there again."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path
from typing import TYPE_CHECKING

from lutgen.effects import catalogue
from lutgen.errors import LutgenError, pick_one, reason_of
from lutgen.files import bytes_at_most

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lutgen.effects import Effect

#: Origin of what is in the catalogue.
BUILT_IN = "built-in"

#: So begins the origin of what a running program has declared.
_CODE = "code,"


def record_of(effect: Effect, folder: Path) -> dict[str, str]:
    """Say where an effect can be found again, for a file in ``folder``: its origin and, of a user's file, the SHA-256.

    The origin is ``built-in``, the way from ``folder`` to a .py file, a package, or an expression.

    Raises LutgenError: it was declared by a running program, or its file is gone.
    """
    if not effect.origin.endswith(".py"):
        if effect.origin.startswith(_CODE):
            message = (
                f"effect {effect.name!r} was declared in code ({effect.origin}), where a file cannot find it again. "
            )
            raise LutgenError(message + "Put it into a .py file of its own.")
        return {"origin": effect.origin}
    file = Path(effect.origin)
    origin = Path(os.path.relpath(file.resolve(), folder.resolve())).as_posix()
    return {"origin": origin, "sha256": _sha256(file, effect.name)}


def found_by(name: str, record: Mapping[str, str], folder: Path) -> Effect:
    """Find an effect again by what :func:`record_of` said in a file in ``folder``.

    Raises LutgenError: it is not there any more, its file has changed, or a user's effect breaks the contract.
    """
    from lutgen.effects import own
    from lutgen.effects.contract import refuse_unsound

    origin = record.get("origin", BUILT_IN)
    if origin == BUILT_IN:
        return _chosen(name, catalogue())
    if not origin.endswith(".py"):
        return own.recall(name, origin)
    file = folder / origin
    now, was = _sha256(file, name), record.get("sha256", "")
    if was and now != was:
        message = (
            f"effect {name!r}: its file {file} has changed (SHA-256 {now[:12]}…, was {was[:12]}…), so it need not be "
            f"the same effect any more. Restore the file, or make the model anew with it (lutgen refine)."
        )
        raise LutgenError(message)
    refuse_unsound([file])
    return _chosen(name, {each.name: each for each in own.load_file(file)})


def _chosen(name: str, effects: Mapping[str, Effect]) -> Effect:
    if name not in effects:
        raise pick_one("effect", name, effects)
    return effects[name]


def _sha256(file: Path, name: str) -> str:
    from lutgen.effects.own import MAX_BYTES

    try:
        return hashlib.sha256(bytes_at_most(file, MAX_BYTES, none="file of effects")).hexdigest()
    except OSError as error:
        reason = reason_of(error)
        message = f"effect {name!r}: cannot read its file {file}: {reason}. Put it back there."
        raise LutgenError(message) from None
