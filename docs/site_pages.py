"""What pages of the site have beside their Markdown: replays of what moves, cards to choose from.

Both are HTML around Markdown, so that Sphinx finds the pictures and the links.
"""

import re

_FIGURE = """<figure class="moving">

{picture}

<figcaption>
<button type="button" data-replay="{replay}" hidden>Turn it yourself</button>
<a href="{replay}">full page</a>
</figcaption>
</figure>"""


def with_replays(text: str, pictures: str, static: str) -> str:
    """A page with a button below each picture that moves, which puts a replay in its place.

    Args:
        text: Markdown.
        pictures: pattern of their files, whose group is the name of the replay.
        static: the way from the page to the folder of what is static.
    """

    def figure(found: re.Match[str]) -> str:
        return _FIGURE.format(picture=found[0], replay=f"{static}/replays/{found[1]}.html")

    return re.sub(rf"^!\[.*\]\({pictures}\)$", figure, text, flags=re.MULTILINE)


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

[![{name}](films/{name}.webp)]({name}.md)

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
        task=task,
        size=size,
        acts=acts,
        seen=seen,
        sees=sees,
        limit=limit,
    )
