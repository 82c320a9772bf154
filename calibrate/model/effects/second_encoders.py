"""Where along a joint with two encoders an effect sits: which of the two readings, and whether the flange, shows it.

A joint turns a shaft, a drive and a link. Reading of the controller, reading of the second encoder and true angle of
the link give three places for one effect:

* as listed: between the controller's reading and everything else, so that flange and second encoder both show it (the
  disc of the controller's encoder; a drive with the second encoder on its link side);
* `SECOND`: in the second encoder's own reading, so that only the difference shows it (its disc, its slip);
* `AGAINST`: a drive with the second encoder on its motor side and the controller's on the link side: only the
  difference shows it, and with the other sign;
* `PAST`: a drive behind both encoders: only the flange shows it.

The rig may state on which side a second encoder sits (`encoder_side`); where it does not, all places compete.
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from acquisition.recording.rig.schema import EncoderSide
from calibrate.model.effects.drivers import Drivers
from calibrate.model.effects.ports import Place, Port
from calibrate.model.effects.term import Form, Term
from calibrate.model.sensors.encoder_difference import NAME as ENCODER_DIFFERENCE

SECOND, AGAINST, PAST = "second encoder", "motor side of the second encoder", "past both encoders"
PLACES = (SECOND, AGAINST, PAST)
READERS = frozenset({"encoder-eccentricity", "encoder-harmonic", "encoder-slip", "reading-lag"})
DRIVES = frozenset({"joint-compliance", "payload-compliance", "backlash", "gear-transmission-error", "joint-coupling"})
EITHER = frozenset({"gear-ratio-error"})  # a scale of a disc, or a ratio of a drive: against is a scale of other sign


def at_second_encoders(terms: Iterable[Term], drivers: Drivers) -> tuple[Term, ...]:
    """The other places of these terms in a session with second encoders; none in one without."""
    reading = drivers.readouts.get(ENCODER_DIFFERENCE)
    if reading is None:
        return ()
    return tuple(moved for term in terms if isinstance(term, Form) for moved in _moved(term, drivers, reading.joints))


def placed(term: Term) -> str:
    """Of PLACES, or "" where a term stands as listed."""
    named = (place for place in PLACES if term.variant.endswith(place))
    return max(named, key=len, default="")  # the name of one place ends with that of another


def _moved(term: Form, drivers: Drivers, joints: tuple[int, ...]) -> Iterator[Term]:
    if not term.port.between_encoders or term.directions is None:
        return
    joint = int(np.flatnonzero(term.directions[:, 0])[0]) + 1
    if joint not in joints:
        return
    side = drivers.rig.arm.joints[joint - 1].encoder_side
    channel = np.array([[float(j == joint)] for j in joints])
    reading = Port(term.port.where, Place.READING, instrument=ENCODER_DIFFERENCE)
    drive = term.physics in DRIVES and side is not EncoderSide.LINK
    if term.physics in READERS | EITHER or (term.open and len(term.depends_on) == 1):
        sentence = term.sentence.replace(f"Joint {joint}", f"The second encoder of joint {joint}", 1)
        yield _at(term, reading, SECOND, sentence, channel)
    if drive:
        yield _at(term, reading, AGAINST, f"{term.sentence}; the second encoder sits on its motor side", -channel)
    if drive or (term.physics in EITHER and side is not EncoderSide.LINK):
        port = replace(term.port, past_encoders=True)
        yield _at(term, port, PAST, f"{term.sentence}; behind both encoders", term.directions)


def _at(term: Form, port: Port, place: str, sentence: str, directions: np.ndarray) -> Form:
    variant = f"{term.variant}, {place}" if term.variant else place
    return replace(term, port=port, variant=variant, sentence=sentence, directions=directions)
