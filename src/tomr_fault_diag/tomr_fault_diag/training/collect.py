"""Drives through the simulator and the residual stages: codes and true states, tick by tick."""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np
from attrs import frozen
from numpy.typing import NDArray
from tqdm import tqdm

from tomr_fault_diag.residuals.frame import RESIDUALS, ResidualFrame
from tomr_fault_diag.residuals.sources import residual_inputs
from tomr_fault_diag.residuals.stage import ResidualStage
from tomr_fault_diag.training.drives import Drive, random_drive
from tomr_fault_diag.training.labels import TOPIC, Truth, label_of, truth_of
from tomr_power_model.messages.bag import bag_message
from tomr_power_model.messages.inputs import TWIST_STAMPED, model_inputs
from tomr_power_model.model.predictor import PowerPredictor
from tomr_power_model.robot import shipped_robot
from tomr_sim_bridge.missions.drive import drive, start_mission
from tomr_sim_bridge.plant.samples import build

Codes = NDArray[np.int8]

_START_NS = 1_700_000_000 * 1_000_000_000


@frozen
class Examples:
    """Ticks that can be told: codes (n, 10) and true states (n,)."""

    codes: Codes
    labels: Codes

    @classmethod
    def join(cls, parts: Iterable["Examples"]) -> "Examples":
        """All parts in order."""
        listed = list(parts)
        return cls(
            np.concatenate([part.codes for part in listed]),
            np.concatenate([part.labels for part in listed]),
        )


def collect(seeds: Iterable[int], title: str) -> Examples:
    """Run one drive per seed, on all cores; the result depends on the seeds alone."""
    wanted = list(seeds)
    with ProcessPoolExecutor(max_workers=os.cpu_count()) as pool:
        parts = list(
            tqdm(pool.map(examples_of, wanted), total=len(wanted), desc=title, unit="drive")
        )
    return Examples.join(parts)


def examples_of(seed: int) -> Examples:
    """Drive once; returns the ticks whose state can be told."""
    return _labelled(watch(random_drive(shipped_robot("reference"), seed)))


@frozen
class Watched:
    """A drive tick by tick: the residuals, and the truth at the time (None: not told yet)."""

    frames: tuple[ResidualFrame, ...]
    truths: tuple[Truth | None, ...]


def watch(chosen: Drive) -> Watched:
    """Run a drive through the simulator and the first two stages."""
    predictor = PowerPredictor(chosen.believed)
    stage = ResidualStage(chosen.believed)
    takers: dict[str, list[Callable[[Any, int], str | None]]] = {}
    for item in (
        *model_inputs(chosen.believed, predictor, TWIST_STAMPED),
        *residual_inputs(chosen.believed, stage),
    ):
        takers.setdefault(item.topic, []).append(item.take)
    simulation = start_mission(chosen.mission, chosen.plant, chosen.seed, _START_NS)
    frames: list[ResidualFrame] = []
    truths: list[Truth] = []
    for samples in drive(chosen.mission, simulation, chosen.seed):
        for sample in samples:
            if sample.topic == TOPIC:
                truths.append(truth_of(build(sample.message, bag_message), sample.stamp_ns))
            if sample.topic in takers:
                message = build(sample.message, bag_message)
                for take in takers[sample.topic]:
                    take(message, sample.stamp_ns)
            for prediction in predictor.due():
                stage.prediction(prediction)
            frames.extend(stage.due())
    stamps = np.array([truth.stamp_ns for truth in truths])
    places = np.searchsorted(stamps, [frame.stamp_ns for frame in frames], side="right") - 1
    return Watched(tuple(frames), tuple(truths[place] if place >= 0 else None for place in places))


def _labelled(watched: Watched) -> Examples:
    codes: list[tuple[int, ...]] = []
    labels: list[int] = []
    healthy_since = 0
    for frame, truth in zip(watched.frames, watched.truths, strict=True):
        if truth is not None and truth.fault is not None:
            healthy_since = frame.stamp_ns
        label = label_of(frame, truth, healthy_since)
        if label is not None:
            codes.append(frame.codes)
            labels.append(label)
    return Examples(
        np.array(codes, dtype=np.int8).reshape(-1, RESIDUALS), np.array(labels, dtype=np.int8)
    )
