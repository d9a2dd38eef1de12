"""What is wrong with the text of a figure: cut at its edge, or over another text."""

from itertools import combinations

from matplotlib.text import Text

EDGE = 1.0
"""How far a text may stand out of its figure [px]."""
COVERED = 0.15
"""Share of the smaller of two texts that the other one may cover."""


def faults_of_text(figure):
    """Return a sentence for each text that is cut, and for each pair of texts that overlap."""
    figure.canvas.draw()
    renderer, whole = figure.canvas.get_renderer(), figure.bbox
    undrawn = _undrawn(figure)
    boxes = [
        (" ".join(text.get_text().split()), text.get_window_extent(renderer))
        for text in figure.findobj(Text)
        if text.get_visible() and text.get_text().strip() and text not in undrawn
    ]
    faults = []
    for words, box in boxes:
        out = max(-box.x0, -box.y0, box.x1 - whole.x1, box.y1 - whole.y1)
        if out > EDGE:
            faults.append(f"'{words}' is cut: {out:.0f} px stand out of the figure")
    for (words, box), (other, under) in combinations(boxes, 2):
        width = min(box.x1, under.x1) - max(box.x0, under.x0)
        height = min(box.y1, under.y1) - max(box.y0, under.y0)
        smaller = min(box.width * box.height, under.width * under.height)
        if width > 0.0 and height > 0.0 and width * height > COVERED * smaller:
            faults.append(f"'{words}' and '{other}' overlap")
    return faults


def _undrawn(figure):
    """Return the texts of axes that are off, and of ticks beyond the ends of their axis."""
    texts = []
    for axes in figure.axes:
        shown = axes.get_visible() and axes.axison
        for axis in (axes.xaxis, axes.yaxis):
            low, high = sorted(axis.get_view_interval())
            texts += [] if shown and axis.get_visible() else [axis.label]
            for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks()):
                if not (shown and axis.get_visible() and low <= tick.get_loc() <= high):
                    texts += [tick.label1, tick.label2]
    return set(texts)
