"""The chain from base to reading as a row of boxes, with the place of a finding marked."""

from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

from calibrate.report.elements import Html
from calibrate.report.svg import drawn
from calibrate.report.tones import Tone
from calibrate.sensors.catalogue import kind_of
from calibrate.sensors.kind import Trait


@dataclass(frozen=True)
class Link:
    """A part of the chain; `ports` are the beginnings of the ports that sit in it."""

    name: str
    ports: tuple[str, ...]


def chain_of(joints: int, instruments: Sequence[str]) -> tuple[Link, ...]:
    """From the base to the readings of the instruments that were there."""
    out = [Link("clock", ("time",)), Link("base", ("base.",))]
    for i in range(1, joints + 1):
        out += [Link(f"J{i}", (f"joint{i}.",)), Link(f"link {i}", (f"link{i}.",))]
    out.append(Link("tool", ("tool.", "laser.")))
    traits = {trait for name in instruments for trait in kind_of(name).traits}
    if Trait.LIGHT in traits:
        out += [Link("fixture", ("fixture.",)), Link("PSD 1", ("psd1.",)), Link("PSD 2", ("psd2.",))]
    if Trait.CONES in traits:
        out.append(Link("cone", ("seat.",)))
    if Trait.DEVICE in traits:
        out.append(Link("device", ("device.",)))
    return tuple(out)


def chain_figure(name: str, where: str, chain: Sequence[Link]) -> Html:
    """With the link of the port `where` marked."""
    says = f"the chain from base to reading, {where} marked"
    rows = -(-len(chain) // _per_row(len(chain)))
    return drawn(f"chain-{name}", says, 4.8, 0.25 + 0.62 * rows, lambda figure: _paint(figure, where, chain))


def _per_row(links: int) -> int:
    return -(-links // (-(-links // 6)))


def _paint(figure: Figure, where: str, chain: Sequence[Link]) -> None:
    axes = figure.add_subplot()
    axes.set_axis_off()
    per_row = _per_row(len(chain))
    for at, link in enumerate(chain):
        row, column = divmod(at, per_row)
        marked = any(where.startswith(port) for port in link.ports)
        _box(axes, column, -row, link.name, where.partition(".")[2] if marked else None)
        if at + 1 < len(chain):
            last = column == per_row - 1
            start, end = ((column + 0.44, -row), (column + 0.56, -row)) if not last else ((column, -row - 0.3), None)
            if end is not None:
                axes.plot([start[0], end[0]], [start[1], end[1]], color=Tone.SOFT.value, lw=1.2)
    rows = -(-len(chain) // per_row)
    axes.set(xlim=(-0.55, per_row - 0.45), ylim=(-rows + 0.5, 0.5))


def _box(axes: Axes, x: float, y: float, name: str, port: str | None) -> None:
    edge, width = (Tone.BEAM.value, 2.2) if port is not None else (Tone.SOFT.value, 0.8)
    shape = FancyBboxPatch(
        (x - 0.41, y - 0.26), 0.82, 0.52, boxstyle="round,pad=0.02,rounding_size=0.08", fc="none", ec=edge, lw=width
    )
    axes.add_patch(shape)
    colour = Tone.BEAM.value if port is not None else Tone.INK.value
    axes.text(x, y + (0.09 if port else 0.0), name, ha="center", va="center", fontsize=10, color=colour)
    if port:
        axes.text(x, y - 0.12, port, ha="center", va="center", fontsize=10, color=colour)
