"""Before measuring: which causes a plan could show, from which size on, and which it could not separate.

The session of the plan is made up at the nominal rig, with angles and readings that scatter as the rig assumes, and
put on the bench of a diagnosis: what that would search for, and how large it had to be, does not depend on what is
read.
"""

from dataclasses import dataclass

import msgspec
import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from acquisition.recording.rig import Rig
from calibrate.design.candidates import Candidates, Taken
from calibrate.diagnose.assess import Isolability, Named, Smallest, isolability, named, smallest_visible
from calibrate.diagnose.search import Bench
from calibrate.diagnose.state import fit_geometry, session_of
from calibrate.model.dual_psd_rig import assumed_noise
from calibrate.model.sensors.position import POSITION_ASSUMED_M

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Seen:
    """What a diagnosis of the plan's session could find."""

    smallest: tuple[Smallest, ...]  # of every place and physics that the poses show
    confusable: tuple[tuple[Named, Named, float], ...]  # pairs, and R2
    invisible: tuple[Named, ...]  # what geometry would swallow
    isolability: Isolability

    @property
    def confusable_causes(self) -> tuple[tuple[Named, Named, float], ...]:
        """One pair a pair of causes, its most alike forms; forms of one cause are no pair."""
        best: dict[frozenset[tuple[str, str]], tuple[Named, Named, float]] = {}
        for a, b, r2 in self.confusable:
            causes = frozenset({(a.physics, a.where), (b.physics, b.where)})
            if len(causes) == 2 and (causes not in best or r2 > best[causes][2]):
                best[causes] = (a, b, r2)
        return tuple(best.values())


def seen_by(rig: Rig, candidates: Candidates, taken: Taken, rng: Generator) -> Seen:
    """Of a plan's poses in their order, with their approaches and repeats. DataError where they are too few to fit."""
    poses = candidates.take(taken.poses)
    reading = poses.reading + rng.normal(0.0, _noise_m(rig, poses), poses.reading.shape)
    q_rad = poses.q_rad + rng.normal(0.0, assumed_noise(rig).joint_rad, poses.q_rad.shape)
    samples = Candidates(q_rad, reading, poses.placement, poses.first_psd).samples(taken.approach, taken.repeat)
    bench = Bench(fit_geometry(session_of(_without_distances(rig), samples)))
    isolable = isolability(bench.menu)
    pairs = tuple((named(a), named(b), r2) for a, b, r2 in isolable.confusable())
    invisible = tuple(dict.fromkeys(named(term) for term in bench.menu.invisible))
    return Seen(smallest_visible(bench), pairs, invisible, isolable)


def _noise_m(rig: Rig, poses: Candidates) -> float:
    if poses.spots:
        return assumed_noise(rig).psd_m
    return rig.noise.position_m or POSITION_ASSUMED_M


def _without_distances(rig: Rig) -> Rig:
    """A diagnosis examines readings alone; a distance as assumed would agree with the drawing and show nothing."""
    return msgspec.structs.replace(rig, known_distances=())
