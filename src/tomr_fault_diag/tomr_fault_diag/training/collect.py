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
from tomr_fault_diag.training.drives import random_drive
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
    chosen = random_drive(shipped_robot("reference"), seed)
    predictor = PowerPredictor(chosen.believed)
    stage = ResidualStage(chosen.believed)
    takers: dict[str, list[Callable[[Any, int], str | None]]] = {}
    for item in (
        *model_inputs(chosen.believed, predictor, TWIST_STAMPED),
        *residual_inputs(chosen.believed, stage),
    ):
        takers.setdefault(item.topic, []).append(item.take)
    simulation = start_mission(chosen.mission, chosen.plant, seed, _START_NS)
    frames: list[ResidualFrame] = []
    truths: list[Truth] = []
    for samples in drive(chosen.mission, simulation, seed):
        for sample in samples:
            if sample.topic == TOPIC:
                truths.append(truth_of(build(sample.message, bag_message), sample.stamp_ns))
            for take in takers.get(sample.topic, ()):
                take(build(sample.message, bag_message), sample.stamp_ns)
            for prediction in predictor.due():
                stage.prediction(prediction)
            frames.extend(stage.due())
    return _labelled(frames, truths)


def _labelled(frames: list[ResidualFrame], truths: list[Truth]) -> Examples:
    codes: list[tuple[int, ...]] = []
    labels: list[int] = []
    stamps = np.array([truth.stamp_ns for truth in truths])
    healthy_since = 0
    for frame in frames:
        place = int(np.searchsorted(stamps, frame.stamp_ns, side="right")) - 1
        truth = truths[place] if place >= 0 else None
        if truth is not None and truth.fault is not None:
            healthy_since = frame.stamp_ns
        label = label_of(frame, truth, healthy_since)
        if label is not None:
            codes.append(frame.codes)
            labels.append(label)
    return Examples(
        np.array(codes, dtype=np.int8).reshape(-1, RESIDUALS), np.array(labels, dtype=np.int8)
    )
