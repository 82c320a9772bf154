"""What makes the report a certificate: which robot, who, where, with what; blank lines in print for what is absent."""

from acquisition.recording import Recording
from acquisition.recording.rig.schema import SiteInstrument
from calibrate.report.elements import Html, section, tag

TITLE = "Certificate"
LEAD = "From [site] of the rig file, as recorded. What is absent there is a blank line in print."
MAKES = {
    "abb": "ABB",
    "fanuc": "FANUC",
    "franka": "Franka",
    "kuka": "KUKA",
    "staubli": "Stäubli",
    "ur": "Universal Robots",
}
BLANK_INSTRUMENTS = 2  # lines for instruments where the rig file names none
SIGNED = ("Place, date", "Calibrated by", "Checked by")


def certificate(recording: Recording) -> Html:
    """Facts, instruments, signatures; on a screen only where the rig file states any of it."""
    rig, site = recording.rig, recording.rig.site
    make = None if rig.arm.make is None else MAKES.get(rig.arm.make.value, rig.arm.make.value.capitalize())
    pairs = (
        ("Robot", site.robot or make),
        ("Serial number", rig.arm.serial_number),
        ("Place", site.place),
        ("Operator", site.operator),
        ("Measured (UTC)", when(recording) or None),
    )
    known = bool(site.robot or site.place or site.operator or site.instruments or rig.arm.serial_number)
    facts = tag("dl", *(part for name, value in pairs for part in (tag("dt", name), tag("dd", _or_blank(value)))))
    signatures = tag("div", *(tag("div", _blank(), tag("span", name)) for name in SIGNED), cls="signatures")
    content = section(
        "certificate", TITLE, LEAD, tag("div", facts, _instruments(site.instruments), cls="panels"), signatures
    )
    return content if known else tag("div", content, cls="print-only")


def when(recording: Recording) -> str:
    """Start of the session to the second, UTC; empty where it is not known."""
    return recording.started_utc.partition(".")[0].partition("+")[0].replace("T", " ")


def _instruments(listed: tuple[SiteInstrument, ...]) -> Html:
    head = ("Instrument", "serial number", "calibrated", "certificate")
    rows = [
        (i.name, i.serial_number, None if i.calibrated is None else i.calibrated.isoformat(), i.certificate)
        for i in listed
    ] or [(None,) * len(head)] * BLANK_INSTRUMENTS
    body = (tag("tr", *(tag("td", _or_blank(value), cls="t") for value in row)) for row in rows)
    top = tag("thead", tag("tr", *(tag("th", text, scope="col", cls="t") for text in head)))
    return tag("div", tag("table", top, tag("tbody", *body)), cls="scroll")


def _or_blank(value: str | None) -> str:
    return _blank() if value is None else value


def _blank() -> Html:
    """A line to write on."""
    return tag("span", cls="blank")
