"""A session before two detectors on site: plan preview, measurement, review; more poses or places while a person wants.

A fixture that nobody vouches for counts as moved.
"""

from dataclasses import replace

from acquisition.recording.mcap import next_part
from acquisition.recording.rig import Placement
from acquisition.session.records import Sample
from acquisition.session.session import check_planned
from acquisition.session.stepping import Summary
from calibeam.asking import Asking
from calibeam.console import Console
from calibeam.learner import FittedLearner
from calibeam.live.feed import SILENT, Feed
from calibeam.outcome import INTERRUPTS, PartialResult, interruption
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
from calibeam.sessions.person import Person
from calibeam.sessions.reporter import StatusReporter
from calibeam.sessions.run import OnSite
from calibeam.sessions.status import Listener, clock_words
from calibeam.sessions.views import PageView, PlainView, TerminalView
from calibrate.design import (
    POSE_S,
)
from drivers.clock import SystemClock

FINISH, MORE, PLACE = "f", "m", "n"


class WithDetectors(OnSite):
    """`earlier`: what the session goes on with; `stands`: the fixture has not been touched since.

    `asking`: the terminal at which a person sits; `agrees`: who needs not be asked whether the arm may move.
    """

    def __init__(
        self,
        job: Job,
        console: Console,
        earlier: EarlierParts,
        feed: Feed = SILENT,
        *,
        asking: Asking | None,
        agrees: bool,
        stands: bool,
    ) -> None:
        if job.plan is not None:
            check_planned(job.plan)
        clock = SystemClock()
        terminal = TerminalView(console) if asking is not None and console.is_terminal else None
        view: Listener = PlainView(console) if terminal is None else terminal
        reporter = StatusReporter(job.rig, clock, (view, PageView(feed)))
        opened = {} if terminal is None else {"view": terminal.opened}
        person = Person(console, reporter, asking, agrees=agrees, **opened)
        super().__init__(job.rig, job.out, job.addresses.hurry, console, clock, person)
        self._job, self._feed, self._earlier, self._stands = job, feed, earlier, stands
        self._half_size_m = FittedLearner(job.rig).optics.half_size_m

    def _catch_up(self, *, failed: bool) -> None:
        earlier = read_earlier_parts(self._out, self._rig) if failed else self._earlier
        self._earlier = self._since(earlier, stands=self._stands and not failed)

    def _since(self, earlier: EarlierParts, *, stands: bool) -> EarlierParts:
        """Where the fixture stands now, as far as it matters: a place that was left half done."""
        standing = earlier.standing
        if standing is None:
            return earlier
        part = part_of(self._job, earlier, self._half_size_m)
        if not part.open_at(standing):
            return replace(earlier, standing=None)
        question = f"does the fixture still stand at station {standing}?"
        choices = {"y": "yes, it was not touched", "n": "no or not sure: it is measured again, as a new station"}
        if stands or self._person.choose(question, choices, "n", "n") == "y":
            return earlier
        place = same_place(part.rig, standing)
        self._reporter.report(
            f"station {standing} is measured again as station {place.id}; what was taken there still counts"
        )
        return with_fixture_moved(earlier, place, standing)

    def _next_part(self) -> int:
        self._part = part_of(self._job, self._earlier, self._half_size_m)
        return self._part.left

    def _preview(self) -> None:
        """Gone through and drawn."""
        from calibeam.motion.rehearsal import draw_session  # matplotlib takes a second to load

        part = self._part
        self._reporter.step("plan preview")
        drawing = next_part(self._out).with_suffix(".plan.svg")
        self._reporter.report(draw_session(part.rig, drawing, part.options, part.plan))
        before = f", {len(part.earlier.taken)} taken before" if part.earlier.begun else ""
        about = clock_words(POSE_S * part.left / self._job.addresses.hurry)
        self._reporter.report(f"readings to take: {part.left}, repeats among them{before}; about {about}")

    def _confirm(self) -> None:
        self._reporter.step("confirmation")
        super()._confirm()

    def _measure(self) -> bool:
        """A further part, where a person wants another place."""
        part = self._part
        self._reporter.step("measurement")
        ahead = ahead_of_blocks(part.rig, part.blocks) if part.plan is None else ahead_of_plan(part.rig, part.plan)
        path = next_part(self._out)
        try:
            with measuring(
                self._job, part, ahead, path, self._clock, (self._reporter, self._person), self._feed
            ) as session:
                summary, rounds = session.take(), 0
                while True:
                    self._look(session, summary, part)
                    answer = self._decide(part)
                    if answer != MORE or session.placement is None:
                        break
                    rounds += 1
                    self._reporter.step("measurement")
                    summary = session.take(more_at(part, session.placement, self._half_size_m, part.options, rounds))
        except KeyboardInterrupt as why:  # at a question, while the arm stands
            INTERRUPTS.close()
            raise PartialResult(f"{interruption(why)}; what was taken is kept in {self._out}; {GO_ON}") from why
        except PartialResult as early:
            raise PartialResult(f"{early}; {GO_ON}") from early.__cause__
        self._reporter.report(f"samples {len(summary.samples)}, skipped {summary.skipped}; recording: {path}")
        place = self._new_place(part) if answer == PLACE else None
        if place is None:
            return False
        self._earlier = with_place(read_earlier_parts(self._out, self._rig), place)
        return True

    def _look(self, session: Measuring, summary: Summary[Sample], part: Part) -> None:
        """How good it is."""
        self._reporter.step("review")
        quality = self._reporter.shown.quality
        settled = "" if quality is None or not quality.unsettled else f", {quality.unsettled} of them did not settle"
        self._reporter.report(
            f"{len(part.earlier.taken) + len(summary.samples)} poses{settled}; {summary.skipped} left out"
        )
        try:
            forecast = session.forecast_now()
        except Exception as why:  # as in forecast.py: what was measured is worth more than a forecast of it
            self._reporter.report(f"no forecast: {type(why).__name__}: {why}")
            return
        self._reporter.forecast(forecast)
        self._reporter.report(f"predicted error of the beam over the workspace: {forecast.says}")

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
        self._reporter.report(f"station {place.id}; to keep it, add to the rig file:{placement_text(place)}")
        return place
