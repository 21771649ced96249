import click

from lutgen.cli.command import Command, Section
from lutgen.cli.options import WHOLE, Choice
from lutgen.cli.outputs import say
from lutgen.names import BASELINES


@click.command(cls=Command, section=Section.CRITICISM, place=6)
@click.argument("data", metavar="[DATA]", required=False)
@click.option("--image", metavar="IMAGE", help="Look at this image [default: stained tissue].")
@click.option("--model", metavar="FILE", help="Start from a saved model (.toml); without DATA, from its readings too.")
@click.option(
    "--baseline", type=Choice(BASELINES), help="What the model knows, as for compare [default: colour-points]."
)
@click.option("--port", type=WHOLE, default=0, metavar="PORT", help="Port on this computer [default: any free one].")
@click.option("--no-browser", is_flag=True, help="Only print the address.")
def command(
    *, data: str | None, image: str | None, model: str | None, baseline: str | None, port: int, no_browser: bool
) -> None:
    """See a display age, switch physical effects on, watch the error fall, look through the LUT: one page.

    Serves a page to this computer only (127.0.0.1) until Ctrl-C. The page shows IMAGE through the LUT of any hour; the
    error of the model on DATA, a table of readings (.csv) or a campaign file (.toml); and the effects as switches. The
    numbers are those that compare, diagnose, refine and build print, and the page gives the commands. Without DATA the
    page shows a simulated campaign, and says so.

    \b
    Example:
      lutgen explore
      lutgen explore examples/display-a.csv --image slide.png
    """
    import webbrowser
    from threading import Thread

    from lutgen.explore.commands import WindowState, example_readings, tissue
    from lutgen.explore.serve import serve
    from lutgen.server import port_taken

    def opened(address: str) -> None:
        if not (data or model):
            say("These readings are simulated, not measured; the simulated display has two hidden effects.")
        say(f"Ctrl-C ends the page. See it at {address}")
        if not no_browser:
            # webbrowser.open may wait until a browser has started: the server prepares the page in the meantime.
            Thread(target=webbrowser.open, args=(address,), daemon=True).start()

    with port_taken(port) as listening:
        readings = data or ("" if model else str(example_readings()))
        state = WindowState(readings, image or str(tissue()), model, baseline)
        serve(state, listening, opened=opened, wait=bool(data or image or model))
