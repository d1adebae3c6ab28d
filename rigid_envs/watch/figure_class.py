"""Figures of matplotlib that Jupyter shows by themselves: imported when one is made."""

import io

from matplotlib.figure import Figure


class ShownFigure(Figure):
    """A figure that Jupyter shows where it is the value of a cell, with pyplot or without.

    The whole of it is shown: matplotlib's own way would cut off title and numbers.
    """

    def _ipython_display_(self) -> None:
        """Show the picture; called by IPython."""
        from IPython.display import Image, display

        buffer = io.BytesIO()
        self.savefig(buffer, format="png")
        display(Image(buffer.getvalue(), format="png"))  # type: ignore[no-untyped-call]
