"""``--on-screen``, ``--place`` and ``--uniformity``: a picture as it lies on the screen, in commands that draw one."""

from __future__ import annotations

from functools import wraps
from typing import TYPE_CHECKING, Any, NamedTuple

import click

if TYPE_CHECKING:
    from collections.abc import Callable

    from lutgen.display import DisplayModel
    from lutgen.display.on_screen import OnScreen


class AskedPlace(NamedTuple):
    """What the three options say."""

    on_screen: bool
    place: str | None
    uniformity: str | None

    def on(self, model: DisplayModel) -> tuple[DisplayModel, OnScreen | None]:
        """Return the model with its screen's uniformity, and where the picture lies. Raises LutgenError."""
        if not any(self):
            return model, None
        from lutgen.display.on_screen import OnScreen
        from lutgen.display.uniformity import MeasuredUniformity
        from lutgen.readings import read_session

        table = MeasuredUniformity.of(read_session(self.uniformity)) if self.uniformity else None
        screen = OnScreen.parse(self.place, table) if self.place else OnScreen(uniformity=table)
        return screen.aged(model), screen


def screen_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the three options; the command gets them as ``where``."""

    @wraps(command)
    def asked(*, on_screen: bool, place: str | None, uniformity: str | None, **options: Any) -> Any:
        return command(where=AskedPlace(on_screen, place, uniformity), **options)

    for option in reversed(
        (
            click.option(
                "--on-screen",
                is_flag=True,
                help="Age each pixel at its own place on the screen: by the model's effects that know places, such as "
                "edge-falloff, or by --uniformity.",
            ),
            click.option(
                "--place",
                metavar="LEFT,TOP,WIDTH,HEIGHT",
                help="Where on the screen the picture lies, in shares of the screen; implies --on-screen "
                "[default: 0,0,1,1, the whole screen].",
            ),
            click.option(
                "--uniformity",
                metavar="FILE",
                help="Measured uniformity of the screen: white or a grey at 5 places or more; implies --on-screen.",
            ),
        )
    ):
        asked = option(asked)
    return asked
