"""A whole session on site, step by step: devices, plan, arm, measure, look, result.

What a person decides is asked where there is one; a script gets what is safe: no motion without --yes unless the
devices are emulated, and a fixture that nobody vouches for counts as moved.
"""

from contextlib import nullcontext
from dataclasses import replace

from acquisition.recording.mcap import next_part, parts
from acquisition.recording.rig import Placement
from acquisition.session.planned import check_planned
from acquisition.session.session import Summary
from calibeam.asking import Asking
from calibeam.console import Console
from calibeam.interrupts import INTERRUPTS
from calibeam.learner import FittedLearner
from calibeam.live.feed import SILENT, Feed
from calibeam.outcome import PartialResult, interruption
from calibeam.sessions.forecast import ahead_of_blocks, ahead_of_plan
from calibeam.sessions.job import (
    GO_ON,
    EarlierParts,
    Job,
    Part,
    more_at,
    new_place,
    part_of,
    placement_text,
    read_earlier_parts,
    same_place,
    with_fixture_moved,
    with_place,
)
from calibeam.sessions.measure import Measuring, measuring
from calibeam.sessions.person import Person, devices_ready
from calibeam.sessions.reporter import StatusReporter
from calibeam.sessions.status import Listener, clock_words
from calibeam.sessions.views import PageView, PlainView, TerminalView
from calibeam.site_log import SESSION_LOG, SITE_LOG
from calibrate.design import POSE_S
from drivers.clock import Clock, SystemClock

FINISH, MORE, PLACE = "f", "m", "n"


class OnSite:
    """The steps; owns which part of the session comes next."""

    def __init__(
        self, job: Job, console: Console, clock: Clock, feed: Feed, asking: Asking | None, *, agrees: bool
    ) -> None:
        self._job, self._console, self._clock, self._feed = job, console, clock, feed
        SITE_LOG.begin(job.out / SESSION_LOG)
        terminal = TerminalView(console) if asking is not None and console.is_terminal else None
        view: Listener = PlainView(console) if terminal is None else terminal
        self.reporter = StatusReporter(job.rig, clock, (view, PageView(feed)))
        opened = {} if terminal is None else {"view": terminal.opened}
        self._person = Person(console, self.reporter, asking, agrees=agrees, **opened)
        self._half_size_m = FittedLearner(job.rig).optics.half_size_m

    def run(self, earlier: EarlierParts, *, stands: bool) -> None:
        """Everything, until there is nothing more to be measured. PartialResult, and what its steps raise.

        `stands`: the fixture has not been touched since the earlier parts.
        """
        devices_ready(self._job.rig, self._job.addresses.hurry, self._clock, self._person)
        earlier, agreed, broken = self._since(earlier, stands=stands), False, False
        while True:
            with self._person.keeping(self._job.out) if broken else nullcontext():
                part = part_of(self._job, earlier, self._half_size_m)
                if part.left == 0:
                    self.reporter.report("everything that was planned is taken")
                    break
                self._plan(part)
                if not agreed:
                    self.reporter.step("confirmation")
                    self._person.arm()
                    agreed = True
            try:
                place = self._measure(part)
            except PartialResult as early:
                if not self._person.goes_on(early):
                    raise
                with self._person.keeping(self._job.out):
                    agreed, broken, earlier = False, True, self._again()
                continue
            if place is None:
                break
            earlier = with_place(read_earlier_parts(self._job.out, self._job.rig), place)
        self.reporter.step("results")
        files = parts(self._job.out)
        from calibeam.results.session_results import (
            write_session_results,  # a second of libraries that no device waits for
        )

        write_session_results(files[0] if len(files) == 1 else self._job.out, self._console)

    def _again(self) -> EarlierParts:
        """After a failure every device is connected again, and asked for, into a further recording."""
        devices_ready(self._job.rig, self._job.addresses.hurry, self._clock, self._person)
        return self._since(read_earlier_parts(self._job.out, self._job.rig), stands=False)

    def _since(self, earlier: EarlierParts, *, stands: bool) -> EarlierParts:
        """Where the fixture stands now, as far as it matters: a place that was left half done."""
        standing = earlier.standing
        if standing is None:
            return earlier
        part = part_of(self._job, earlier, self._half_size_m)
        if not part.open_at(standing):
            return replace(earlier, standing=None)
        question = f"does the fixture still stand at station {standing}?"
        told = {"y": "yes, it was not touched", "n": "no or not sure: it is measured again, as a new station"}
        if stands or self._person.choose(question, told, "n", "n") == "y":
            return earlier
        place = same_place(part.rig, standing)
        self.reporter.report(
            f"station {standing} is measured again as station {place.id}; what was taken there still counts"
        )
        return with_fixture_moved(earlier, place, standing)

    def _plan(self, part: Part) -> None:
        """Gone through and drawn before anything moves."""
        from calibeam.motion.rehearsal_figure import draw_session  # matplotlib takes a second to load

        self.reporter.step("plan preview")
        drawing = next_part(self._job.out).with_suffix(".plan.svg")
        self.reporter.report(draw_session(part.rig, drawing, part.options, part.plan))
        before = f", {len(part.earlier.taken)} taken before" if part.earlier.begun else ""
        about = clock_words(POSE_S * part.left / self._job.addresses.hurry)
        self.reporter.report(f"readings to take: {part.left}, repeats among them{before}; about {about}")

    def _measure(self, part: Part) -> Placement | None:
        """A part; a further place that a person wants, None: it is enough."""
        self.reporter.step("measurement")
        ahead = ahead_of_blocks(part.rig, part.blocks) if part.plan is None else ahead_of_plan(part.rig, part.plan)
        path = next_part(self._job.out)
        try:
            with measuring(
                self._job, part, ahead, path, self._clock, (self.reporter, self._person), self._feed
            ) as session:
                summary, rounds = session.take(), 0
                while True:
                    self._look(session, summary, part)
                    answer = self._decide(part)
                    if answer != MORE or session.placement is None:
                        break
                    rounds += 1
                    self.reporter.step("measurement")
                    summary = session.take(more_at(part, session.placement, self._half_size_m, part.options, rounds))
        except KeyboardInterrupt as why:  # at a question, while the arm stands
            INTERRUPTS.close()
            raise PartialResult(f"{interruption(why)}; what was taken is kept in {self._job.out}; {GO_ON}") from why
        except PartialResult as early:
            raise PartialResult(f"{early}; {GO_ON}") from early.__cause__
        self.reporter.report(f"samples {len(summary.samples)}, skipped {summary.skipped}; recording: {path}")
        return self._new_place(part) if answer == PLACE else None

    def _look(self, session: Measuring, summary: Summary, part: Part) -> None:
        """How good it is."""
        self.reporter.step("review")
        quality = self.reporter.shown.quality
        settled = "" if quality is None or not quality.unsettled else f", {quality.unsettled} of them did not settle"
        self.reporter.report(
            f"{len(part.earlier.taken) + len(summary.samples)} poses{settled}; {summary.skipped} left out"
        )
        try:
            forecast = session.forecast_now()
        except Exception as why:  # as in forecast.py: what was measured is worth more than a forecast of it
            self.reporter.report(f"no forecast: {type(why).__name__}: {why}")
            return
        self.reporter.forecast(forecast)
        self.reporter.report(f"predicted error of the beam over the workspace: {forecast.says}")

    def _decide(self, part: Part) -> str:
        choices = {FINISH: "finish: identify, diagnose, report"}
        if part.plan is None:
            choices |= {MORE: "more poses, the fixture stays", PLACE: "another station of the fixture"}
        return self._person.choose("what next?", choices, FINISH, FINISH)

    def _new_place(self, part: Part) -> Placement | None:
        """None: the terminal went instead of an answer, and it is enough."""
        numbers = self._person.numbers("PSD 1 in the base: x y z in m, and the turn about z in degrees", 4)
        if numbers is None:
            return None
        place = new_place(part.rig, numbers)
        self.reporter.report(f"station {place.id}; to keep it, add to the rig file:{placement_text(place)}")
        return place


def run_session(
    job: Job,
    console: Console,
    earlier: EarlierParts,
    feed: Feed = SILENT,
    *,
    asking: Asking | None,
    agrees: bool,
    stands: bool,
) -> None:
    """The whole session. `earlier`: what it goes on with; `stands`: the fixture has not been touched since.

    `asking`: the terminal at which a person sits; `agrees`: who needs not be asked whether the arm may move.
    """
    if job.plan is not None:
        check_planned(job.plan)
    clock = SystemClock()
    job.out.mkdir(parents=True, exist_ok=True)
    site = OnSite(job, console, clock, feed, asking, agrees=agrees)
    site.run(earlier, stands=stands)
