from pathlib import Path

import click

from lutgen.cli.command import Command
from lutgen.cli.options import WHOLE
from lutgen.cli.outputs import progress_bar, say


@click.command(cls=Command)
@click.argument("study", metavar="STUDY")
@click.option(
    "--reader", required=True, metavar="NAME", help="Name of the reader; a new name takes the next free place."
)
@click.option("--session", type=WHOLE, required=True, metavar="N", help="Number of the reading session, from 1.")
@click.option("--override", metavar="REASON", help="Begin before the washout is over, or with a clock set back.")
@click.option("--port", type=WHOLE, default=0, metavar="PORT", help="Port on this computer [default: any free one].")
@click.option("--no-browser", is_flag=True, help="Only print the address.")
def command(*, study: str, reader: str, session: int, override: str | None, port: int, no_browser: bool) -> None:
    """Hold a reading session in the browser: one image at a time, pixel by pixel on neutral grey, names hidden.

    Serves a page to this computer only (127.0.0.1) until the reading session is complete or Ctrl-C. Practice images
    come first. For each image the page records the diagnosis, the ease of reading, and the time from the first paint of
    the image to the diagnosis. An answer is on disk (STUDY/answers, one file for each reader) before the page shows the
    next image. The same command continues a reading session that was stopped; an image that was shown without an answer
    is shown again. A reading session begins when the one before is complete and the washout is over; --override begins
    earlier, and the reason is recorded.

    The page warns about zoom, a window smaller than the images, a screen wider than sRGB or in HDR, and a browser that
    alters pixels. A page cannot see the colour profile of the screen, and no program can see that a clock was set
    forward.

    \b
    Example:
      lutgen study run study/ --reader "Dr A" --session 1
    """
    import signal
    import webbrowser

    from lutgen.server import port_taken
    from lutgen.study.reading import begin_reading
    from lutgen.study.server import serve

    def opened(address: str) -> None:
        # A reader whose name was mistyped notices another place, and that all images are left.
        say(f"{now.reader}, place {now.place} of {now.protocol.readers}: {now.left} images left.")
        say(f"Ctrl-C stops; the same command continues. Read at {address}")
        if not no_browser:
            webbrowser.open(address)

    # A shell starts background jobs with SIGINT ignored: handle it again.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    # The port comes first: if the port is busy, the reader takes no place.
    with port_taken(port) as listening, progress_bar("checking the images") as progress:
        begun = begin_reading(Path(study), reader=reader, session=session, override=override, progress=progress)
        with begun as now:
            try:
                serve(now, opened=opened, say=lambda text: say(f"lutgen: {text}", err=True), listening=listening)
            finally:
                read = f"{now.read} of {len(now.images)} images are read and saved"
                rest = f", {now.left} left." if now.left else f". {now.following()}".rstrip()
                say(f"Reading session {session} of {now.reader}: {read}{rest}")
