"""Take the picture of `lutgen explore` in README again (``make explore-picture``).

It shows the example with one of its two hidden effects switched on.
"""

import io
import tempfile
from pathlib import Path

from PIL import Image

from tests.browser import browser
from tests.test_explore_page import FINAL, LONG, ROOT, click, explored, opened

PICTURE = ROOT / "docs/images/explore.jpg"

TRIED = "[...document.querySelectorAll('#effects li:not(.unseen-by-data) .alone')].every((each) => each.firstChild)"
FIGURES = "/\\d/.test(document.getElementById('figure-hours_to_5').textContent)"


def main() -> None:
    """Take the picture."""
    with tempfile.TemporaryDirectory() as folder, browser(Path(folder)) as page, explored(ROOT) as (address, _):
        page.size(1280, 720)
        opened(page, address)
        page.wait(TRIED, LONG)
        click(page, "#effect-eotf-drift")
        page.wait(f"document.querySelector('.parameter') && {FINAL} && {FIGURES}", LONG)
        move = "(() => { const hours = document.getElementById('hours'); hours.value = 15000;"
        page.ask(f"{move} hours.dispatchEvent(new Event('input')); }})()")
        page.ask("new Promise((done) => setTimeout(done, 3000))")
        shot = page.picture()
    with Image.open(io.BytesIO(shot)) as image:
        image.convert("RGB").save(PICTURE, quality=66, optimize=True, progressive=True)
    print(PICTURE.relative_to(ROOT))


if __name__ == "__main__":
    main()
