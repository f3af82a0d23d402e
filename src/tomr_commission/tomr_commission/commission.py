"""The steps of a commissioning, in their order; each keeps its result, so that a rerun resumes."""

import datetime
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from attrs import asdict, evolve, frozen

from tomr_commission.alarm import AlarmLevel, Tail, alarm_level
from tomr_commission.bands import RegimeLine, bands_of, regime_table
from tomr_commission.commissioned import (
    CLASSIFIER,
    FILE,
    RESIDUALS,
    Record,
    base_sections,
    commissioned_text,
)
from tomr_commission.explained import EXPLAINED, FOLDER, Split, explain_drives
from tomr_commission.healthy import MOST_GATHERED, Healthy, decided, healthy
from tomr_commission.injected import kinds_for, try_injected
from tomr_commission.observed import Observed, observe, reports_currents, unit_of_motors
from tomr_commission.parallel import on_all_cores
from tomr_commission.rehearsal import Rehearsal, Shoved, Usage, electrical_off, rehearse
from tomr_commission.request import CommissionRequest
from tomr_commission.simulated import try_simulated
from tomr_commission.store import Store, digest, fingerprint
from tomr_commission.suspects import check_values, check_wheels, notes_on
from tomr_commission.trials import Floor, Trial, floors_of
from tomr_commission.verdict import Outcome, Reason, Recorded, early_reasons, reasons
from tomr_fault_diag.classifier.commissioned import stamp_of
from tomr_fault_diag.classifier.settings import ClassifierSettings
from tomr_fault_diag.diagnosis.settings import DiagnosisSettings
from tomr_fault_diag.residuals.settings import BandSettings
from tomr_power_model.drive.cut import names_of
from tomr_power_model.drive.read import read_drive
from tomr_power_model.drive.record import Drive
from tomr_power_model.effects.user import named_files
from tomr_power_model.errors import InputError
from tomr_power_model.files.write import make_folder, write_together
from tomr_power_model.robot import (
    load_robot,
    read_description,
    read_node_sections,
    suite_version,
)
from tomr_reality_gap.report.write import write_report

Progress = Callable[[str, float], None]
Say = Callable[[Sequence[Reason]], object]

STEPS = "steps"
_CURRENTS = (
    "shoves were not simulated: the robot reports currents, not powers; so the alarm level is the "
    "shipped one at least, and how many false alarms shoves raise is not known"
)
_MORE = 1.1  # of the least that is held out: ends of recordings are not compared
_TO_BE = "to be"  # commissioned: it is judged as it will be
_HOPELESS = 1.5  # times the caution that may be needed: more shoves will not bring it down


@frozen
class Commissioned:
    """All that a commissioning found."""

    request: CommissionRequest
    outcome: Outcome
    reasons: tuple[Reason, ...]
    regimes: tuple[RegimeLine, ...]
    margin: float  # of the bands
    driven: Healthy
    shoved: Shoved
    plan: Rehearsal
    trials: tuple[Trial, ...]
    floors: tuple[Floor, ...]
    text: str  # of commissioned.yaml
    date: str
    notes: tuple[str, ...] = ()

    @property
    def unfound(self) -> tuple[str, ...]:
        """Kinds of fault that no size tried shows at every wheel."""
        return tuple(floor.kind for floor in self.floors if floor.everywhere is None)

    @property
    def is_go(self) -> bool:
        """Whether nothing speaks against switching the diagnosis on."""
        return not self.reasons

    @property
    def verdict(self) -> str:
        """go or no-go."""
        return "go" if self.is_go else "no-go"


@frozen
class Tuned:
    """Bands, and the alarm level that they ask for."""

    margin: float
    bands: BandSettings
    driven: Healthy
    shoved: Shoved
    level: AlarmLevel


def commission(request: CommissionRequest, progress: Progress, say: Say) -> Commissioned:
    """Run all steps that are not done yet; `say` hears what makes a no-go as soon as it is known.

    Raises InputError for what cannot be used.
    """
    work = _Work.begin(request, progress)
    explained = work.explained()
    described = work.description(explained)
    drives = work.observed(described)
    fitted, held = work.divided(drives)
    say(early_reasons(Recorded(request, explained, fitted, held)))
    silent = set.intersection(*(set(drive.silent) for drive in fitted))
    longest = max(held, key=lambda drive: drive.hours)
    classifier, plan = work.classifier(described), Rehearsal(silent=tuple(sorted(silent)))
    tuned = work.tuned(described, fitted, classifier, plan)
    bands, level = tuned.bands, tuned.level
    chosen = evolve(tuned.driven.settings, caution=level.caution)
    robot = str(work.source(described))
    progress("validating", 0.85)
    said = decided([*held, *fitted], bands, chosen, robot)
    held_said, fitted_said = said[: len(held)], said[len(held) :]
    trials = try_injected(longest, bands, chosen, kinds_for(longest), robot)
    notes = notes_on(work.drives, load_robot(request.robot))
    if not chosen.small_faults:
        notes.append(
            "small faults that last are not looked for: healthy driving looks like one within its "
            f"bands (it gathers {tuned.driven.gathered:.0f} nats, {MOST_GATHERED:g} are allowed)"
        )
    if reports_currents(longest):
        notes.append(_CURRENTS)
    simulated, note = work.simulated(described, bands, chosen, unit_of_motors(longest))
    trials += simulated
    notes += [note] if note else []
    floors = floors_of(trials)
    outcome = Outcome(request, explained, fitted, held, bands, level, held_said, fitted_said)
    against = tuple(reasons(outcome))
    date = datetime.datetime.now(datetime.UTC).date().isoformat()
    text = _text(
        work,
        described,
        outcome,
        against=against,
        floors=floors,
        date=date,
        small_faults=chosen.small_faults,
    )
    progress("done", 1.0)
    return Commissioned(
        request=request,
        outcome=outcome,
        reasons=against,
        regimes=tuple(regime_table(fitted, bands)),
        margin=tuned.margin,
        driven=tuned.driven,
        shoved=tuned.shoved,
        notes=tuple(notes),
        plan=plan,
        trials=tuple(trials),
        floors=tuple(floors),
        text=text,
        date=date,
    )


@frozen
class _Work:
    """One commissioning under way."""

    request: CommissionRequest
    progress: Progress
    store: Store
    key: str  # of the recordings and the description
    split: Split
    names: tuple[str, ...]  # of the recordings
    drives: tuple[Drive, ...]  # as recorded

    @classmethod
    def begin(cls, request: CommissionRequest, progress: Progress) -> "_Work":
        progress("checking", 0.0)
        values = read_description(request.robot)
        robot = load_robot(request.robot)
        prints = [fingerprint(path) for path in (*request.bags, *named_files())]
        skips = repr(sorted(request.skips.items()))
        key = digest([suite_version(), repr(sorted(values.items())), skips, *prints])
        drives = tuple(read_drive(bag, robot) for bag in request.bags)
        for bag, drive in zip(request.bags, drives, strict=True):
            if not len(drive.command_time):
                raise InputError(f"{bag}: no cmd_vel: record it too, the simulation needs it")
        check_wheels(drives, robot, str(request.robot))
        check_values(drives[0], values, str(request.robot))
        durations = [drive.duration for drive in drives]
        split = Split.of(request.bags, durations, _MORE * 60.0 * request.limits.held_minutes)
        names = tuple(names_of(request.bags))
        store = Store(request.out / STEPS)
        return cls(request, progress, store, key, split, names, drives)

    def explained(self) -> Any:
        """What the search found, its files in a folder of their own."""
        request = self.request

        def make() -> Any:
            return explain_drives(
                request,
                self.split,
                lambda stage, part: self.progress(f"explaining: {stage}", 0.02 + 0.4 * part),
            )

        key = digest([self.key, repr(request.tolerance), repr(len(self.split.held))])
        found = self.store.values("explained", key, make)
        folder = request.out / FOLDER
        make_folder(folder)
        write_report(folder, found["files"])
        return found

    def description(self, explained: Any) -> Path | None:
        """The explained description; None: nothing was missing."""
        if not explained["explained"]:
            return None
        return self.request.out / FOLDER / EXPLAINED

    def source(self, described: Path | None) -> str | Path:
        """What the rest is done with."""
        return self.request.robot if described is None else described

    def observed(self, described: Path | None) -> list[Observed]:
        """All recordings as the residual stage sees them."""
        self.progress("running the diagnosis", 0.45)
        source = self.source(described)
        key = digest([self.key, repr(sorted(read_description(source).items()))])
        kept = [self.store.observed(f"drive_{name}", key) for name in self.names]
        jobs = [
            (bag, name, str(source))
            for bag, name, one in zip(self.request.bags, self.names, kept, strict=True)
            if one is None
        ]
        if jobs:
            made = {drive.name: drive for drive in on_all_cores(_observe, jobs)}
            for name, drive in made.items():
                self.store.keep(f"drive_{name}", key, drive)
            kept = [
                made[name] if one is None else one
                for name, one in zip(self.names, kept, strict=True)
            ]
        skips = self.request.skips
        return [drive.without(skips.get(drive.name, ())) for drive in kept if drive is not None]

    def divided(
        self, drives: Sequence[Observed]
    ) -> tuple[tuple[Observed, ...], tuple[Observed, ...]]:
        """Fitted drives, and those held out."""
        if self.split.cut is None:
            count = len(self.split.fitted)
            return tuple(drives[:count]), tuple(drives[count:])
        at = int(np.searchsorted(drives[0].seconds, self.split.cut))
        first = drives[0].part(slice(0, at), f"{drives[0].name} (first two thirds)")
        return (first,), (drives[0].part(slice(at, None), f"{drives[0].name} (last third)"),)

    def classifier(self, described: Path | None) -> ClassifierSettings:
        """Settings of the classifier as the description has them."""
        given = read_node_sections(self.source(described), (CLASSIFIER,))
        settings = DiagnosisSettings.of(given, self.request.robot).classifier
        caution = ClassifierSettings().caution
        return evolve(settings, classifier="window", caution=caution, commissioned=_TO_BE)

    def tuned(
        self,
        described: Path | None,
        fitted: Sequence[Observed],
        settings: ClassifierSettings,
        plan: Rehearsal,
    ) -> Tuned:
        """The narrowest bands with which false alarms can be as rare as wanted."""
        robot, choice, share = str(self.source(described)), self.request.bands, 0.55
        plan = evolve(plan, electrical=electrical_off(fitted, plan.off))
        while True:
            self.progress("simulating healthy hours", share)
            bands = bands_of(fitted, choice)
            driven = healthy(fitted, bands, settings, robot, self.request.alarm.block)
            wider = choice.wider * choice.margin
            shoved = Shoved()
            # A few shoves show where many are not worth while.
            for part, patience in zip(plan.parts, (_HOPELESS, 1.0), strict=True):
                if not reports_currents(fitted[0]):
                    more = self.rehearsed(described, bands, driven.settings, part)
                    shoved = shoved.followed_by(more)
                level = _level(self.request, driven, shoved, plan)
                if level.needed > patience * choice.most_caution and wider <= choice.widest:
                    break
            else:
                return Tuned(choice.margin, bands, driven, shoved, level)
            choice, share = evolve(choice, margin=wider), min(share + 0.07, 0.8)

    def rehearsed(
        self,
        described: Path | None,
        bands: BandSettings,
        settings: ClassifierSettings,
        plan: Rehearsal,
    ) -> Shoved:
        """Simulated shoves."""
        source, usage = str(self.source(described)), self.usage()
        parts = (*self._parts(source, settings), bands, usage, plan)
        key = digest(map(repr, parts))
        held = self.store.values(
            f"rehearsed_{key}",
            key,
            lambda: asdict(rehearse(source, bands, settings, usage, plan)),
        )
        return Shoved(tuple(held["peaks"]), held["hours"])

    def usage(self) -> Usage:
        """How the robot is driven."""
        return Usage.of(np.concatenate([drive.command for drive in self.drives]))

    def simulated(
        self, described: Path | None, bands: BandSettings, settings: ClassifierSettings, unit: str
    ) -> tuple[list[Trial], str]:
        """Simulated faults, and a note where the simulator cannot do the robot."""
        self.progress("simulating faults", 0.9)
        source, usage = str(self.source(described)), self.usage()

        def make() -> dict[str, Any]:
            try:
                trials = try_simulated(source, bands, settings, usage, unit)
            except InputError as error:
                return {"trials": [], "note": f"no faults were simulated: {error}"}
            return {"trials": [asdict(trial) for trial in trials], "note": ""}

        key = digest(map(repr, (*self._parts(source, settings), bands, usage)))
        found = self.store.values("simulated", key, make)
        return [Trial(**values) for values in found["trials"]], found["note"]

    def _parts(self, source: str, settings: ClassifierSettings) -> tuple[object, ...]:
        """What everything simulated hangs on, weights of the classifier included."""
        described = sorted(read_description(source).items())
        return self.key, described, settings, stamp_of("", settings, load_robot(source))


def _observe(job: tuple[Path, str, str]) -> Observed:
    bag, name, source = job
    given = read_node_sections(source, (RESIDUALS, "power_model"))
    return observe(bag, name, load_robot(source), DiagnosisSettings.of(given, source))


def _level(
    request: CommissionRequest, real: Healthy, shoved: Shoved, plan: Rehearsal
) -> AlarmLevel:
    """From real driving and from simulated shoves."""
    tails = (
        Tail.of("healthy driving", real.peaks, len(real.peaks) / real.hours, request.alarm),
        Tail.of("simulated shoves", shoved.peaks, plan.shoves_per_hour, request.alarm),
    )
    shipped = ClassifierSettings().caution
    return alarm_level(tails, request.false_alarms_per_hour, shipped, request.alarm)


def _text(
    work: _Work,
    described: Path | None,
    outcome: Outcome,
    *,
    against: Sequence[Reason],
    floors: Sequence[Floor],
    date: str,
    small_faults: bool,
) -> str:
    """Of commissioned.yaml."""
    request = work.request
    record = Record(
        date=date,
        drives=tuple(drive.name for drive in outcome.fitted),
        held_out=outcome.held_name,
        method="exponential tails of the classifier's evidence, real driving and simulated shoves",
        level=outcome.level,
        small_faults=small_faults,
        floors={floor.kind: floor.words for floor in floors},
        verdict="no-go" if against else "go",
        stamp=""
        if against
        else stamp_of(date, work.classifier(described), load_robot(work.source(described))),
    )
    sections = base_sections(request.robot, described)
    return commissioned_text(sections, outcome.bands, record, Path(request.robot).name)


def write_results(found: Commissioned, texts: dict[str, str]) -> list[Path]:
    """Write commissioned.yaml and the reports; returns what was written."""
    folder = found.request.out
    written = {folder / name: text for name, text in {FILE: found.text, **texts}.items()}
    write_together(written)
    return list(written)
