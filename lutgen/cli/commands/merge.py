import click

from lutgen.cli.command import Command, Section
from lutgen.cli.options import Choice, numbers, replace_option
from lutgen.cli.outputs import Outputs
from lutgen.names import MODES


@click.command(cls=Command, section=Section.OTHERS_FILES, place=2)
@click.argument("build", metavar="BUILD_DIR")
@click.option("--into", required=True, metavar="CONFIG", help="Your config; unchanged, unless -o is its own folder.")
@click.option("-o", "--output", required=True, metavar="DIR", help="Folder for the merged config and its LUT files.")
@click.option("--mode", type=Choice(MODES), default="chroma", show_default=True, help="The aging mode.")
@click.option("--hours", required=True, metavar="LIST", help="Hours of the build, in a list.")
@click.option("--source-space", metavar="NAME", help="Your colour space whose code values are sent to the display.")
@click.option("--onto", multiple=True, metavar="DISPLAY", help="Display that gets the views [default: sRGB displays].")
@click.option("--prefix", default="Aged", show_default=True, help="Prefix of the new names.")
@click.option("--json", "json_to", metavar="FILE", help="Write the result as JSON; - is standard output.")
@replace_option
def command(
    *,
    build: str,
    into: str,
    output: str,
    mode: str,
    hours: str,
    source_space: str | None,
    onto: tuple[str, ...],
    prefix: str,
    json_to: str | None,
    force: bool,
) -> None:
    """Add aged views to your own config, and prove that everything else stays as it is.

    Adds a view, a colour space, a look and (from version 2) a named transform for each hour. lutgen compares every
    view, colour space and look of your config pixel by pixel before and after, and each aged view with the view of the
    build; if one differs, nothing is written. Comments are kept where lutgen can insert the parts into your text;
    otherwise OpenColorIO writes the whole config, and lutgen says so.

    --source-space names the space of the values that reach the display: --source-space "Filmic sRGB" ages the pictures
    of that view. Without --source-space the sRGB signal is defined through the role aces_interchange, if the config has
    that role.

    \b
    Example:
      lutgen merge aged/ --into my-config/config.ocio --mode chroma --hours 10000 -o merged/
    """
    from lutgen.merge import Merging, merge
    from lutgen.report.lut_files import merge_page

    outputs = Outputs(json_to, force=force)
    merging = Merging([(mode, hour) for hour in numbers("--hours", hours)], prefix, source_space, onto)
    merged = merge(build, into, output, merging, force=force)
    outputs.write(merge_page(merged), merged.as_json)
