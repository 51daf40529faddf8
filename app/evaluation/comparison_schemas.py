"""Two runs side by side, in REST and as CSV."""

from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from typing import Any

from pydantic import BaseModel, Field

from app.domain.pose_changes import Change, PlacedPose, PosePair
from app.evaluation.comparison import Comparison
from app.evaluation.comparison_figures import Figure
from app.evaluation.schemas import Interval
from app.identities.shown import Identities, VesselId
from app.runs import service as runs
from app.runs import setting_words
from app.tables.runs import Run, RunStatus

COUNTING = (
    "Everything is counted on the images that both runs have done.",
    (
        "A difference is this run minus the other one. Its 95 % interval: the same images drawn "
        "anew 400 times for both runs (paired bootstrap). Where it holds no 0, the runs differ."
    ),
    (
        "Reviews and boxes count where people gave them, for each run its own; verdicts inherited "
        "from an earlier run count, too."
    ),
    "Poses that a person made are left out: they say nothing about the pipeline.",
    (
        "Two poses are of the same ship when they have the same detection (or boxes that cover "
        "each other by IoU 0.5), else when they have the same vessel."
    ),
)
FIGURE_COLUMNS = (
    "section",
    "name",
    "label",
    "unit",
    "run",
    "other",
    "difference",
    "low",
    "high",
    "run_count",
    "other_count",
)
CHANGE_COLUMNS = (
    "image_id",
    "file_name",
    "captured_at",
    "changes",
    "moved_m",
    "turned_deg",
    "vessel",
    "other_vessel",
    "pose_id",
    "other_pose_id",
)


class ComparedRunOut(BaseModel):
    """One of the two runs."""

    id: int
    label: str
    site_id: int
    viewport_id: int
    detector: str
    status: RunStatus
    created_at: datetime
    is_reference: bool = Field(description="The run that the site is measured by")
    images_done: int


class ParameterOut(BaseModel):
    """Something that was decided before the runs began, in words."""

    name: str
    label: str
    run: str
    other: str
    differs: bool


class CountOut(BaseModel):
    """How many of something each run has, on the images both have."""

    name: str
    label: str
    run: int
    other: int
    difference: int


class FigureOut(BaseModel):
    """A figure of both runs; null where nothing defines it. `difference` is run minus other."""

    group: str
    name: str
    label: str
    unit: str = Field(description="share (fraction of one), m, ° or nothing")
    run: float | None
    other: float | None
    run_count: int = Field(description="How many poses, detections or vessels it rests on")
    other_count: int
    difference: float | None
    interval: Interval | None = Field(description="95 % of the difference, over paired images")

    @classmethod
    def of(cls, one: Figure) -> "FigureOut":
        """Take the figures."""
        paired = one.paired
        return cls(
            group=one.group.value,
            name=one.name,
            label=one.label,
            unit=one.unit,
            run=paired.run.value,
            other=paired.other.value,
            run_count=paired.run.count,
            other_count=paired.other.count,
            difference=paired.difference,
            interval=paired.interval,
        )


class ComparisonOut(BaseModel):
    """Two runs side by side; where poses changed is told by `/evaluation/runs/changes`."""

    run: ComparedRunOut
    other: ComparedRunOut
    images_both: int
    parameters: list[ParameterOut]
    counts: list[CountOut]
    figures: list[FigureOut]
    poses_in_both: int = Field(description="Poses of the same ship in the same image")
    changes: dict[str, int] = Field(description="Poses that changed, by how; one may count twice")
    changed: int
    counting: list[str]


class ChangedPoseOut(BaseModel):
    """A pose that is not as it was; `vessel` is an MMSI, or a pseudonym where the site says so."""

    image_id: int
    file_name: str
    captured_at: datetime | None
    changes: list[Change]
    moved_m: float | None
    turned_deg: float | None
    vessel: VesselId | None
    other_vessel: VesselId | None
    pose_id: int | None
    other_pose_id: int | None


def comparison_out(
    comparison: Comparison,
    sides: tuple[Run, Run],
    reference_ids: frozenset[int],
    least: tuple[float, float],
) -> ComparisonOut:
    """Write a comparison out; `sides` are run and other, `least` metres and degrees."""
    run, other = sides
    found = [pair.changes(*least) for pair in comparison.pairs]
    return ComparisonOut(
        run=_run_out(run, comparison.images_run, reference_ids),
        other=_run_out(other, comparison.images_other, reference_ids),
        images_both=comparison.images_both,
        parameters=parameters(run, other),
        counts=[
            CountOut(
                name=one.name,
                label=one.label,
                run=one.run,
                other=one.other,
                difference=one.run - one.other,
            )
            for one in comparison.counts
        ],
        figures=[FigureOut.of(one) for one in comparison.figures],
        poses_in_both=sum(1 for pair in comparison.pairs if pair.run and pair.other),
        changes={kind.value: sum(kind in changes for changes in found) for kind in Change},
        changed=sum(bool(changes) for changes in found),
        counting=list(COUNTING),
    )


def _run_out(run: Run, images_done: int, reference_ids: frozenset[int]) -> ComparedRunOut:
    return ComparedRunOut(
        id=run.id,
        label=runs.label(run),
        site_id=run.site_id,
        viewport_id=run.viewport_id,
        detector=run.model.name,
        status=run.status,
        created_at=run.created_at,
        is_reference=run.id in reference_ids,
        images_done=images_done,
    )


def parameters(run: Run, other: Run) -> list[ParameterOut]:
    """Return what was decided for two runs, in words, what differs first."""
    both = [_decided(one) for one in (run, other)]
    names = list(dict.fromkeys([*both[0], *both[1]]))
    found = []
    for name in names:
        label, *_ = both[0].get(name) or both[1][name]
        mine, theirs = (side[name][1] if name in side else "not set" for side in both)
        found.append(
            ParameterOut(name=name, label=label, run=mine, other=theirs, differs=mine != theirs)
        )
    return sorted(found, key=lambda one: not one.differs)


def _decided(run: Run) -> Mapping[str, tuple[str, str]]:
    """Return what a run was told, by name: label and value."""
    viewport = run.viewport
    fixed = {
        "viewport": ("Viewport", f"{viewport.camera.name} / {viewport.name}"),
        "registration": ("Registration", f"no. {run.registration_id}"),
        "detector": ("Detector", run.model.name),
        "detector_sha256": ("Detector's file (SHA-256)", run.model.sha256),
        "preset": ("Estimator", run.preset),
        "code_version": ("Code version", run.code_version),
    }
    told = {"decoding_divisor": 1, **run.parameters}  # older runs had no choice
    shown = setting_words.shown(told)
    settings = {name: (words.label, words.value) for name, words in zip(told, shown, strict=True)}
    return fixed | settings


def changed_out(
    pair: PosePair,
    least: tuple[float, float],
    image: tuple[str, datetime | None],
    sides: tuple[Identities, Identities],
) -> ChangedPoseOut:
    """Write a changed pose out; `sides` tell vessels of the run's site and of the other's."""

    def vessel(pose: PlacedPose | None, told: Identities) -> VesselId | None:
        return None if pose is None else told.vessel(pose.mmsi)

    return ChangedPoseOut(
        image_id=pair.image_id,
        file_name=image[0],
        captured_at=image[1],
        changes=pair.changes(*least),
        moved_m=pair.moved_m,
        turned_deg=pair.turned_deg,
        vessel=vessel(pair.run, sides[0]),
        other_vessel=vessel(pair.other, sides[1]),
        pose_id=pair.run.id if pair.run else None,
        other_pose_id=pair.other.id if pair.other else None,
    )


def figure_rows(answer: ComparisonOut) -> list[Mapping[str, object]]:
    """Return the lines of the CSV file: parameters that differ, counts, figures, changes."""
    return list(_lines(answer))


def _lines(answer: ComparisonOut) -> Iterator[dict[str, Any]]:
    for parameter in answer.parameters:
        if parameter.differs:
            yield {"section": "parameter", **parameter.model_dump(exclude={"differs"})}
    for name, run, other in (
        ("images_done", answer.run.images_done, answer.other.images_done),
        ("images_both", answer.images_both, answer.images_both),
    ):
        yield {"section": "count", "name": name, "run": run, "other": other}
    for count in answer.counts:
        yield {"section": "count", **count.model_dump()}
    for figure in answer.figures:
        low, high = figure.interval or (None, None)
        yield {"section": figure.group, **figure.model_dump(), "low": low, "high": high}
    for name, number in answer.changes.items():
        yield {"section": "changed poses", "name": name, "run": number}


def change_rows(items: Sequence[ChangedPoseOut]) -> list[Mapping[str, object]]:
    """Return the lines of the CSV file of changed poses."""
    return [
        {**one.model_dump(mode="json"), "changes": " ".join(change.value for change in one.changes)}
        for one in items
    ]
