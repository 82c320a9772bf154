"""proof.json: what was concealed, what was reported, and how the two compare. docs/proof.md explains every key.

Also the truth of a case as the seal holds it: the part that a score needs, with types.
"""

from collections.abc import Sequence
from typing import Any, Literal

import msgspec

SCHEMA = 1
UNKNOWN = "unknown"
PLAIN = 0.6  # effect over noise from which a cause has to be found and named
CONFIDENT = 0.9  # a name with less is a suspicion, and reported as one


class ProofRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Every part of the file."""


class SizeScore(ProofRecord, frozen=True):
    """A stated size against the true one."""

    name: str
    true: float
    said: float
    sigma: float

    @property
    def inside(self) -> bool:
        return abs(self.said - self.true) <= 1.959964 * self.sigma


class DefectScore(ProofRecord, frozen=True):
    """One concealed mechanism and what became of it."""

    mechanism: str
    physics: str
    port: str
    depends_on: tuple[str, ...]
    enr: float
    located: bool
    equivalent: str  # why another word for the place is as good; mostly empty
    named: bool  # place and physics, as first choice
    driver: bool  # and what it depends on
    among_rivals: bool  # named, or among what was reported to be as good
    unknown_there: bool  # reported at its place: a cause without a name
    sizes: tuple[SizeScore, ...] = ()


class NamedCause(ProofRecord, frozen=True):
    """One finding, in short."""

    where: str
    depends_on: str
    physics: str
    confidence: float
    says: str
    placed: bool  # something was hidden there
    right: bool  # this physics, there

    @property
    def misnamed(self) -> bool:
        """A name of physics, reported as certain, for what was not hidden there."""
        return self.misnamed_from(CONFIDENT)

    def misnamed_from(self, confidence: float) -> bool:
        """The same with this confidence or more."""
        return self.physics != UNKNOWN and self.confidence >= confidence and not self.right


class CaseScore(ProofRecord, frozen=True):
    """One case of the proof."""

    name: str
    sha256: str
    kind: str
    family: str
    places: int
    samples: int
    noise: str
    seed: int
    enr_wanted: float
    attempts: int
    withheld: tuple[str, ...]
    verdict: str  # "failed" where the diagnosis did not end
    defects: tuple[DefectScore, ...]
    said: tuple[NamedCause, ...]
    unexplained: bool
    asks_for: bool  # withheld: what is missing is named, or the cause is found without it
    held_out_before_m: float | None
    held_out_after_m: float | None
    floor_m: float | None  # rms of the noise that was really added; None: not in this unit
    free_space_before_m: float | None
    free_space_after_m: float | None
    cpu_s: float
    error: str = ""
    path: str = "in process"  # or "on wires": how the recording came about
    trouble: str = ""  # of the kind `raised`
    holds: bool | None = None  # what a trouble asks beside its cause; None: nothing
    torque_over_noise: float | None = None  # of a motion: torque left on its unseen end, over the noise that was added

    @property
    def alarmed(self) -> bool:
        """Something is claimed: a finding, or structure without one, which counts as reported where something is
        hidden.
        """
        return bool(self.said) or self.unexplained

    @property
    def misnamed(self) -> bool:
        """At least one such name."""
        return any(s.misnamed for s in self.said)


class ProofFile(ProofRecord, frozen=True):
    """Content of proof.json."""

    schema: Literal[1]
    software: str
    seed: int
    development: bool  # the seed is one that development may have seen: no figure for the public
    command: str
    published: str  # SHA-256 of the list of hashes, printed before anything was diagnosed
    wall_s: float
    cases: tuple[CaseScore, ...]
    without: tuple[str, ...] = ()  # physics that was taken out of the catalogue: those cases count as unlisted ones
    kind: Literal["calibeam-proof"] = "calibeam-proof"


class TrueDefect(msgspec.Struct, frozen=True):
    """One concealed mechanism."""

    mechanism: str
    physics: str
    port: str
    drivers: tuple[str, ...]
    figures: dict[str, float]
    enr: float  # effect over noise, after geometry
    also: tuple[str, ...] = ()  # physics that is truly at this port, too: no wrong name, but not the whole cause


class TrueNoise(msgspec.Struct, frozen=True):
    """One sigma that was drawn, and the rms of what was added."""

    kind: str
    sigma_m: float
    rms_m: float


class FreeSpace(msgspec.Struct, frozen=True):
    """Where the tool truly is at the poses asked: tip, or beam."""

    tip_m: list[list[float]] | None = None
    beam_origin_m: list[list[float]] | None = None
    beam_direction: list[list[float]] | None = None


class Exact(msgspec.Struct, frozen=True):
    """Readings without noise."""

    values_m: list[list[float]]


class Truth(msgspec.Struct, frozen=True):
    """What was hidden; everything else of the sealed document stays in the file."""

    wanted: dict[str, Any]
    defects: tuple[TrueDefect, ...]
    withheld: tuple[str, ...] = ()
    noise: TrueNoise = TrueNoise("white", 0.0, 0.0)
    exact: Exact = Exact([])  # this and the last are of samples: a recorded motion has none
    free_space: FreeSpace = FreeSpace()
    torque_sigma_nm: tuple[float, ...] = ()  # of a motion: one sigma of a reading, of each joint


def truth_of(content: bytes, without: Sequence[str] = ()) -> Truth:
    """Of an opened seal. Physics that was taken out of the catalogue is unknown, and has to be called so."""
    truth = msgspec.json.decode(content, type=Truth)
    defects = (msgspec.structs.replace(d, physics=UNKNOWN) if d.physics in without else d for d in truth.defects)
    return msgspec.structs.replace(truth, defects=tuple(defects))
