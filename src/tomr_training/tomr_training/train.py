"""`tomr_train`: train a classifier on simulated drives and store it with its provenance."""

import argparse
import json
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from attrs import asdict, evolve, frozen
from numpy.typing import NDArray
from tqdm import tqdm

from tomr_fault_diag.classifier.states import STATES
from tomr_fault_diag.residuals.settings import PAPER_BANDS, BandSettings
from tomr_power_model.cli import EXIT_OK, run_main
from tomr_power_model.errors import InputError
from tomr_power_model.files.write import make_folder, write_together
from tomr_training.ensemble import mean_of

if TYPE_CHECKING:  # it takes seconds to import: --help does without
    from tomr_training.planar.generate import LabelledTicks

Ticks = Iterable["LabelledTicks"]

_EPILOG = """\
examples:
  tomr_train --out window.npz
  tomr_train --out codes.npz --classifier wang2024 --bands paper
  tomr_diagnose BAG --set weights=window.npz

Drives come from the planar dynamics of the power model and are drawn from the seeds FIRST,
FIRST+1, ...; validation takes the seeds that follow and never trains. For each FIRST there is a
window network of its own drives, and what is stored is their mean. The same seeds give the same
file, bit by bit, on the same machine. Needs torch: pip install -r requirements-train.txt."""

_BANDS = {"calibrated": BandSettings(), "paper": PAPER_BANDS}
Counts = NDArray[np.int64]
# Of the shipped weights.
_FIRST_SEEDS = {
    "window": (10_000_000, 40_000_000, 50_000_000),
    "wang2024": (10_000_000,),
}
_CHUNK = 10_000  # examples that are validated at a time
# The paper's six, and what is none of them.
_NAMES = (*(state.name for state in STATES), "beyond these")


@frozen
class Trained:
    """What is stored: arrays, where they come from, and the confusion on unseen drives."""

    arrays: dict[str, NDArray[np.float64]]
    provenance: dict[str, object]
    confusion: Counts  # (7, 7), rows true, per tick and without memory


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="tomr_train",
        description="Train a classifier on thousands of simulated drives.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--out", type=Path, required=True, help="weights to write, .npz")
    parser.add_argument(
        "--classifier",
        choices=tuple(_KINDS),
        default="window",
        help="kind of the network (default: %(default)s)",
    )
    parser.add_argument(
        "--bands",
        choices=tuple(_BANDS),
        default="calibrated",
        help="of wang2024: bands that make the codes (default: %(default)s)",
    )
    parser.add_argument("--drives", type=int, default=7200, help="to train on (default 7200)")
    parser.add_argument("--validation", type=int, default=200, help="to validate on (default 200)")
    parser.add_argument(
        "--first-seed",
        type=int,
        nargs="+",
        metavar="FIRST",
        help="of the drives of each network (default: those of the shipped weights)",
    )
    parser.add_argument("--epochs", type=int, help="default: that of the recipe")
    return parser


def _train(arguments: Sequence[str] | None) -> int:
    options = _parser().parse_args(arguments)
    if options.drives < 1 or options.validation < 1:
        raise InputError("--drives and --validation: give at least 1")
    if options.out.suffix != ".npz":
        raise InputError(f"--out {options.out}: give a name that ends in .npz")
    firsts = _first_seeds(options)
    make_folder(options.out.parent)
    try:
        import torch
    except ModuleNotFoundError as error:
        raise InputError(
            f"{error.name} is missing: pip install -r requirements-train.txt"
        ) from None
    from tomr_training.planar.generate import generate

    seeds = [range(first, first + options.drives) for first in firsts]
    validation = range(seeds[-1].stop, seeds[-1].stop + options.validation)
    trained = _KINDS[options.classifier](options, map(generate, seeds), generate(validation))
    arrays: dict[str, Any] = {name: a.astype(np.float32) for name, a in trained.arrays.items()}
    weights = BytesIO()
    np.savez(weights, **arrays)
    confusion = trained.confusion
    text = {
        "classifier": options.classifier,
        **trained.provenance,
        "drives": {
            "simulator": "planar dynamics of tomr_power_model",
            "training_seeds": [[part[0], part[-1]] for part in seeds],
            "validation_seeds": [validation[0], validation[-1]],
        },
        "torch": torch.__version__,
        "states": list(_NAMES),
        "validation": {
            "accuracy": float(np.trace(confusion) / confusion.sum()),
            "confusion_rows_true": confusion.tolist(),
        },
    }
    document = json.dumps(text, indent=2) + "\n"
    write_together({options.out: weights.getvalue(), options.out.with_suffix(".json"): document})
    _print(confusion)
    return EXIT_OK


def _first_seeds(options: argparse.Namespace) -> list[int]:
    """First seeds of the networks' drives, which share none."""
    found = sorted(options.first_seed or _FIRST_SEEDS[options.classifier])
    if options.classifier == "wang2024" and len(found) > 1:
        raise InputError("--first-seed: wang2024 is one network: give one seed")
    if any(after - first < options.drives + options.validation for first, after in pairwise(found)):
        raise InputError("--first-seed: drives of two networks overlap: give seeds further apart")
    return found


def _window(options: argparse.Namespace, train: Iterable[Ticks], unseen: Ticks) -> Trained:
    from tomr_training.fit_window import (
        WindowRecipe,
        check_windows,
        examples_of,
        fit_window,
        torch_scores,
    )
    from tomr_training.planar.generate import PAPER_OF

    recipe = WindowRecipe()
    recipe = evolve(recipe, epochs=options.epochs or recipe.epochs)
    networks, ticks = [], []
    for drives in train:
        examples = examples_of(drives, recipe)
        ticks.append(len(examples))
        with _epochs(recipe.epochs) as progress:
            networks.append(fit_window(examples, recipe, progress))
    network, windows = mean_of(networks), check_windows(examples)
    check = examples_of(unseen, evolve(recipe, healthy=1.0, faulty=1.0))
    named = []
    for start in range(0, len(check), _CHUNK):
        rows = np.arange(start, min(start + _CHUNK, len(check)))
        scores = network.scores_of(check.windows(rows).astype(np.float64))
        named.append(PAPER_OF[scores.argmax(axis=1)])
    provenance: dict[str, object] = {
        "recipe": asdict(recipe),
        "training_ticks": ticks,
        "torch_check": {
            "windows": windows.tolist(),
            "scores": torch_scores(network, windows).tolist(),
        },
    }
    confusion = _confusion(PAPER_OF[check.label], np.concatenate(named))
    return Trained(asdict(network), provenance, confusion)


def _codes(options: argparse.Namespace, train: Iterable[Ticks], unseen: Ticks) -> Trained:
    from tomr_training.fit_codes import Recipe, examples_of, fit

    bands = _BANDS[options.bands]
    recipe = Recipe()
    recipe = evolve(recipe, epochs=options.epochs or recipe.epochs)
    (drives,) = train
    examples, check = examples_of(drives, bands), examples_of(unseen, bands)
    with _epochs(recipe.epochs) as progress:
        fitted = fit(examples, recipe, progress)
    named = fitted.network.probabilities(check.codes.astype(np.float64)).argmax(axis=1)
    provenance: dict[str, object] = {
        "network": "10-30-6, ReLU, softmax (Wang 2024, section 4)",
        "recipe": asdict(recipe),
        "bands": {"kind": options.bands, **asdict(bands)},
        "training_ticks": len(examples.labels),
        "torch_check": {
            "inputs": fitted.check_inputs.astype(int).tolist(),
            "probabilities": fitted.check_probabilities.astype(float).tolist(),
        },
    }
    return Trained(asdict(fitted.network), provenance, _confusion(check.labels, named))


_KINDS: dict[str, Callable[[argparse.Namespace, Iterable[Ticks], Ticks], Trained]] = {
    "window": _window,
    "wang2024": _codes,
}


def _confusion(true: NDArray[np.integer[Any]], named: NDArray[np.integer[Any]]) -> Counts:
    found = np.zeros((len(_NAMES), len(_NAMES)), dtype=np.int64)
    np.add.at(found, (true, named), 1)
    return found


@contextmanager
def _epochs(count: int) -> Iterator[Callable[[float], None]]:
    """A progress bar over epochs that shows the loss."""
    with tqdm(total=count, desc="epochs") as bar:

        def progress(loss: float) -> None:
            bar.set_postfix(loss=f"{loss:.4f}")
            bar.update()

        yield progress


def _print(confusion: Counts) -> None:
    print(
        f"{'true state':24}" + "".join(f"{n:>9}" for n in range(1, len(_NAMES) + 1)) + "   recall"
    )
    for number, (name, row) in enumerate(zip(_NAMES, confusion, strict=True)):
        recall = row[number] / row.sum() if row.sum() else math.nan
        print(f"{name:24}" + "".join(f"{count:9d}" for count in row) + f"   {recall:.3f}")
    print(f"accuracy per tick, without memory: {np.trace(confusion) / confusion.sum():.4f}")


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `tomr_train`."""
    return run_main(_train, arguments)
