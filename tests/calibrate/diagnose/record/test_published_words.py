"""Every word that a diagnosis may say stands in the lists of docs/formats.md; those keep what was promised."""

import re

import msgspec
import numpy as np
import pytest

from acquisition.recording.examination import FOUND, NOT_EXAMINED, NOTHING, ExaminationRecord
from acquisition.recording.recording_examinations import READINGS
from calibeam.results.check_examinations import CHECK_EXAMINATIONS
from calibeam.results.controller_findings import CONTROLLER_ARM
from calibrate.compare.comparison_examinations import COMPARE_EXAMINATIONS
from calibrate.compare.encoder_zeros import ZERO
from calibrate.compare.reconciled_rows import RECONCILE_EXAMINATIONS
from calibrate.diagnose.assess.findings import named
from calibrate.diagnose.assess.pulled_back import picture_driver
from calibrate.diagnose.record.pose_examinations import POSE_EXAMINATIONS
from calibrate.diagnose.record.schema import TORQUES_IN_MOTION
from calibrate.diagnose.streams.continuity import Fault
from calibrate.diagnose.streams.stream_examinations import PAIRS, STREAM_EXAMINATIONS
from calibrate.diagnose.streams.streams_of_recording import EXPLAINS, USUAL
from calibrate.model.effects.catalogue import EFFECTS, missing_of, terms_of
from calibrate.model.effects.curve import causes_of
from calibrate.model.effects.term import Shape
from simulators.conceal.wanted import FAMILIES
from tests.calibrate.model.effects.conftest import full_session

# Version 1 as it was published: names may be added, none may go.
PROMISED = {
    "Ports": "joint<i>.angle link<i>.length|offset|twist|tilt base.pose tool.point laser.direction laser.origin "
    "fixture.pose psd1.reading psd2.reading device.reading device.pose seat.position time",
    "Drivers": "q<i> first_psd previous_pose gravity_torque<i> overturning_moment approach<i> qd<i> last_move<i> "
    "cmd_minus_q<i> t temp_<where> payload spot1 spot2 incidence1 incidence2 psd<k>_sum reading",
    "Shapes": "constant linear quadratic cubic harmonic sign hysteresis exponential step product radial smooth",
    "Physics": "encoder-eccentricity encoder-harmonic gear-transmission-error gear-ratio-error joint-coupling "
    "joint-compliance payload-compliance backlash encoder-slip axis-wobble link-thermal-growth base-compliance "
    "base-moved latency reading-lag tool-sag link-bending psd-nonlinearity psd-gain psd-ambient-light psd-cover-glass "
    "laser-warm-up laser-thermal-drift fixture-moved device-scale device-drift device-periodic seat-moved not-settled "
    "unknown",
}
PLACEHOLDERS = (("<i>", r"\d+"), ("<k>", r"\d+"), ("<where>", r"\w+"))


@pytest.fixture(scope="module")
def lists(request):
    """Title -> the words of its list in the document."""
    text = (request.config.rootpath / "docs" / "formats.md").read_text(encoding="utf-8")
    found = re.findall(r"^\*\*(Ports|Drivers|Shapes|Physics)\*\*: (.*?)(?:\.\n)", text, re.M | re.S)
    return {title: re.findall(r"`([^`]+)`", body) for title, body in found}


def words_of(listed):
    """One expression for all words of a list: `link<i>.length|offset` is link 1 to n, length or offset."""
    each = []
    for word in listed:
        stem, dot, endings = word.rpartition(".")
        pattern = re.escape(stem) + r"\." + f"(?:{endings})" if dot else re.escape(word)
        for placeholder, digits in PLACEHOLDERS:
            pattern = pattern.replace(re.escape(placeholder), digits)
        each.append(pattern)
    return re.compile("|".join(each))


@pytest.fixture(params=FAMILIES)
def drivers(request):
    return full_session(request.param).drivers


@pytest.mark.parametrize("title", PROMISED)
def test_what_was_promised_is_still_there(lists, title):
    assert set(PROMISED[title].split()) - {"harmonic"} <= {word for word in lists[title] if word != "order"}


def test_every_cause_of_the_catalogue_has_published_words(lists, drivers):
    ports, known, physics = (words_of(lists[title]) for title in ("Ports", "Drivers", "Physics"))
    for term in terms_of(drivers):
        name = named(term)
        assert ports.fullmatch(name.where), name
        assert physics.fullmatch(name.physics), name
        assert name.shape in lists["Shapes"], name
        for driver in ",".join(name.depends_on).split(","):
            assert driver in drivers.extra or known.fullmatch(driver), name


def test_every_driver_of_an_unknown_cause_has_a_published_word(lists, drivers):
    known = words_of(lists["Drivers"])
    assert all(name in drivers.extra or known.fullmatch(name) for name in causes_of(drivers))


def test_what_was_not_recorded_is_named_by_a_published_driver(lists):
    stems = {re.sub(r"(<\w+>)$|_<where>$", "", word) for word in lists["Drivers"]} | set(lists["Drivers"])
    for family in FAMILIES:
        for missing in missing_of(full_session(family).drivers):
            assert missing.driver in stems or words_of(lists["Drivers"]).fullmatch(missing.driver), missing
            assert missing.physics in lists["Physics"]


def test_shapes_and_physics_are_the_published_ones(lists):
    assert {shape.value for shape in Shape} == set(lists["Shapes"]) - {"order"}
    assert {effect.physics for effect in EFFECTS} <= set(lists["Physics"])
    assert {*EXPLAINS, *USUAL, *(fault.value for fault in Fault), ZERO} <= set(lists["Physics"])


def test_every_examination_stands_in_the_list_of_its_command(request):
    text = (request.config.rootpath / "docs" / "formats.md").read_text(encoding="utf-8")
    section = text.split("## Examinations", 1)[1].split("\n## ", 1)[0]
    published = {
        row[0].strip(): set(re.findall(r"`([^`]+)`", row[1]))
        for row in re.findall(r"^\| (`\w+`[^|]*) \| ([^|]*) \|$", section, re.M)
    }
    of_streams = {one.what for one, _ in STREAM_EXAMINATIONS}
    of_poses = {*(one.what for one, _ in POSE_EXAMINATIONS), CONTROLLER_ARM.what, TORQUES_IN_MOTION.what}
    registered = {
        "`check`": {one.what for one in CHECK_EXAMINATIONS},
        "`diagnose` of settled samples": of_poses,
        "`diagnose` of streams, beside those": {*of_streams, PAIRS.what, READINGS.what},
        "`compare`": {one.what for one, _ in COMPARE_EXAMINATIONS},
        "`reconcile`": {one.what for one in RECONCILE_EXAMINATIONS},
    }
    assert {command: published[command] for command in registered} == registered
    keys = {name for row in published for name in re.findall(r"`(\w+)`", row)}
    assert keys >= {field.name for field in msgspec.structs.fields(ExaminationRecord)}
    assert published["`outcome`"] == {FOUND, NOTHING, NOT_EXAMINED, "limit"}


def test_every_driver_can_be_drawn(drivers):
    """The picture of a finding has an axis with numbers, whatever its driver."""
    for term in terms_of(drivers):
        names = ",".join(named(term).depends_on).split(",")
        said, values = picture_driver(drivers, names)
        assert values.shape == (len(drivers.t_s),)
        assert np.isfinite(values).any()
        assert said in names, (term.key, said)
