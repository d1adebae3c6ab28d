"""What pages of the site have beside their Markdown: replays of what moves, cards to choose from.

Both are HTML around Markdown, so that Sphinx finds the pictures and the links.
"""

import re
from collections.abc import Mapping
from pathlib import Path

import imagesize
from PIL import Image

from rigid_envs.tools.motions import MOTIONS
from rigid_envs.tools.pages.films import HEIGHT, WIDTH

_FIGURE = """<figure class="moving">

{picture}

<figcaption>
<button type="button" data-replay="{replay}" hidden>Turn it yourself</button>
<a href="{replay}">full page</a>
</figcaption>
</figure>"""
_FILES = rf"films/([A-Z]\w+)\.webp|gallery/({'|'.join(MOTIONS)})\.png"
_PICTURE = re.compile(rf"^!\[.*\]\([./\w]*(?:{_FILES})\)$", re.MULTILINE)


def with_replays(text: str, static: str) -> str:
    """A page with a button below each picture of a motion, which puts a replay in its place.

    Args:
        text: Markdown.
        static: the way from the page to the folder of what is static.
    """

    def figure(found: re.Match[str]) -> str:
        replay = f"{static}/replays/{found[1] or found[2]}.html"
        return _FIGURE.format(picture=found[0], replay=replay)

    return _PICTURE.sub(figure, text)


def with_sizes(body: str, pictures: Mapping[str, Path]) -> str:
    """A page whose pictures take their place before they are fetched, so that no text moves.

    Args:
        body: HTML.
        pictures: their files, by name.
    """

    def sized(found: re.Match[str]) -> str:
        width, height = imagesize.get(pictures[found[1]])
        return f'{found[0]} width="{width}" height="{height}"'

    return re.sub(r'src="[./]*_images/([^"]+)"', sized, body)


def write_stills(films: Path, folder: Path) -> None:
    """Write one picture of each film, at half its time, for cards: a film comes when it is wanted.

    Args:
        films: folder of the films.
        folder: of the pictures, of the names of the films; made if it is not there.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for file in films.glob("[A-Z]*.webp"):
        with Image.open(file) as film:
            film.seek(film.n_frames // 2)
            film.convert("RGB").save(folder / file.name, quality=70)


_FILTERS = """<form class="filters" autocomplete="off" hidden>
<label>Family <select name="family"><option value="">any</option></select></label>
<label>Action <select name="action"><option value="">any</option></select></label>
<label>Observation <select name="observation"><option value="">any</option></select></label>
<label>Goal <select name="goal"><option value="">any</option></select></label>
<button type="reset">all</button>
<output></output>
</form>"""
_CARD = """<div class="card" data-family="{family}" data-action="{action}"
  data-observation="{observation}" data-goal="{goal}">
<a href="{name}.html"><img src="../_static/stills/{name}.webp" data-film="../_images/{name}.webp"
  alt="{name}" width="{width}" height="{height}" loading="lazy"></a>

[**{name}**]({name}.md)

{task}

- Action ({size}): {acts}
- Observation ({seen}): {sees}
- {limit}

</div>"""
_TABLE = re.compile(r"(?:^\|.*\n)+", re.MULTILINE)
_ROW = re.compile(r"^\| \[`.*?\]\((\w+)\.md\) \| (.*) \| (.*) \| (.*) \| (.*) \|$", re.MULTILINE)


def names(text: str) -> list[str]:
    """Names of the environments of their index, in order."""
    return [name for name, *_ in _ROW.findall(text)]


def with_cards(text: str) -> str:
    """The index of the environments with cards in place of its tables, and filters above them."""
    introduction, *sections = re.split(r"^## ", text, flags=re.MULTILINE)
    parts = [f"{introduction}{_FILTERS}\n"]
    for section in sections:
        family, _, rest = section.partition("\n")
        cards = [_card(family, *row) for row in _ROW.findall(rest)]
        grid = "\n\n".join(['<div class="cards">', *cards, "</div>\n"])
        parts.append(f"{family}\n{_TABLE.sub(grid, rest) if cards else rest}")
    return "\n## ".join(parts)


def _card(family: str, name: str, task: str, acts: str, sees: str, limit: str) -> str:
    (size, _, acts), (seen, _, sees) = acts.partition(": "), sees.partition(": ")
    return _CARD.format(
        family=family,
        action={"1": "1 number"}.get(size, f"{size} numbers" if size.isdigit() else size),
        observation="attitude" if "attitude" in sees else "no attitude",
        goal="goal environment" if "goal" in seen else "no goal environment",
        name=name,
        width=WIDTH,
        height=HEIGHT,
        task=task,
        size=size,
        acts=acts,
        seen=seen,
        sees=sees,
        limit=limit,
    )
