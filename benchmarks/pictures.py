"""The two pictures of the READMEs: how fast others are at every size, and pairs a second of large batches.

On no background of their own, in greys and hues that a white page and a black one both show.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from saved import COLLISIONS, CONTESTANTS, FORMS, LARGE, Entry, Key, number

INK = "#7d8590"
# With all of them the curves cover each other; the others are in the tables.
DRAWN = ("prange", "C", "NumPy")


def style() -> Any:
    import matplotlib

    matplotlib.use("svg")
    inked: Any = ("text.color", "axes.edgecolor", "axes.labelcolor", "xtick.color", "ytick.color")
    matplotlib.rcParams.update(dict.fromkeys(inked, INK))
    matplotlib.rcParams.update({"savefig.transparent": True, "legend.frameon": False, "font.size": 9})
    matplotlib.rcParams.update({"axes.spines.top": False, "axes.spines.right": False})
    matplotlib.rcParams.update({"svg.hashsalt": "collide", "svg.fonttype": "path"})  # the same file every time
    from matplotlib import pyplot

    return pyplot


def draw_sizes(found: dict[Key, Entry], threads: int, path: Path) -> None:
    """A panel for each way to state a collision. Shares of collide's speed: on a scale of rates nobody sees a third."""
    plt = style()
    forms = [form for form in COLLISIONS if (form, LARGE, threads, "collide") in found]
    figure, axes = plt.subplots(1, len(forms), figsize=(2.4 * len(forms), 3.1), sharey=True, squeeze=False)
    for ax, form in zip(axes[0], forms, strict=True):
        for name in ("bytes only", "collide", *DRAWN):
            _, label, colour, marker = CONTESTANTS[name]
            points = sorted((n, 1 / e.ratio) for (f, n, t, c), e in found.items() if (f, t, c) == (form, threads, name))
            if name == "bytes only":
                ax.plot(*zip(*points, strict=True), color=colour, linestyle="--", linewidth=1, label=label)
            elif points:
                width = 2.5 if name == "collide" else 1.2
                ax.plot(
                    *zip(*points, strict=True), color=colour, marker=marker, markersize=4, linewidth=width, label=label
                )
        ax.set_xscale("log")
        ax.set_ylim(0, 1.6)
        ax.set_title(FORMS[form], fontsize=10)
        ax.set_xlabel("pairs in a batch")
        ax.grid(color=INK, alpha=0.2)
    axes[0][0].set_ylabel("speed (collide = 1)")
    handles, labels = axes[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="lower center", ncols=len(labels), fontsize=8)
    figure.tight_layout(rect=(0, 0.07, 1, 1))
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


def draw_bars(found: dict[Key, Entry], threads: int, path: Path) -> None:
    """A panel for each form, a bar for each contestant that was measured there, up to the memory limit."""
    plt = style()
    forms = [form for form in FORMS if (form, LARGE, threads, "collide") in found]
    names = [n for n in CONTESTANTS if n != "bytes only" and any((form, LARGE, threads, n) in found for form in forms)]
    across = min(3, len(forms))
    down = -(-len(forms) // across)
    figure, axes = plt.subplots(
        down, across, figsize=(3.2 * across, 0.6 + 0.27 * down * (len(names) + 3)), sharey=True, squeeze=False
    )
    for ax in axes.flat[len(forms) :]:
        ax.axis("off")
    for ax, form in zip(axes.flat, forms, strict=False):
        limit = found[form, LARGE, threads, "bytes only"].rate / 1e6
        ax.axvline(limit, color=INK, linestyle="--", linewidth=1)
        for i, name in enumerate(names):
            entry = found.get((form, LARGE, threads, name))
            if entry is None:
                ax.text(limit / 50, i, "not written for it", va="center", fontsize=7, fontstyle="italic", alpha=0.7)
                continue
            rate = entry.rate / 1e6
            ax.barh(i, rate, color=CONTESTANTS[name][2], height=0.7)
            inside = rate > limit / 2
            place, side = (rate - limit / 50, "right") if inside else (rate + limit / 50, "left")
            ax.text(place, i, number(rate), va="center", ha=side, fontsize=8, color="black" if inside else INK)
        ax.set_title(FORMS[form], fontsize=10)
        ax.set_xlim(0, limit * 1.15)
    for ax in axes[-1]:
        ax.set_xlabel("million pairs a second")
    axes[0][0].set_yticks(range(len(names)), [CONTESTANTS[name][1] for name in names])
    axes[0][0].invert_yaxis()
    figure.tight_layout()
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)
