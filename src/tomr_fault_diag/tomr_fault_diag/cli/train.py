"""`tomr_train`: train the network on simulated drives and store it with its provenance."""

import argparse
import json
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from attrs import asdict
from numpy.typing import NDArray
from tqdm import tqdm

from tomr_fault_diag.classifier.network import Network
from tomr_fault_diag.classifier.states import STATES
from tomr_power_model.cli import EXIT_OK, run_main
from tomr_power_model.errors import InputError

if TYPE_CHECKING:  # torch is there only where someone trains
    from tomr_fault_diag.training.fit import Fitted, Recipe

_EPILOG = """\
Drives are drawn from the seeds FIRST, FIRST+1, ...; validation takes the seeds that follow and
never trains. The same seeds give the same weights. Needs torch: pip install -r
requirements-train.txt."""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="tomr_train",
        description="Train the paper's 10-30-6 network on drives of the simulator.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--out", type=Path, required=True, help="weights to write (.npz)")
    parser.add_argument("--drives", type=int, default=280, help="to train on (default 280)")
    parser.add_argument("--validation", type=int, default=70, help="to validate on (default 70)")
    parser.add_argument("--first-seed", type=int, default=1000, help="of the drives")
    parser.add_argument("--epochs", type=int, default=100)
    return parser


def _train(arguments: Sequence[str] | None) -> int:
    options = _parser().parse_args(arguments)
    if options.drives < 1 or options.validation < 1:
        raise InputError("--drives and --validation: give at least 1")
    try:
        from tomr_fault_diag.training.fit import Recipe, fit
    except ModuleNotFoundError as error:
        raise InputError(
            f"{error.name} is missing: pip install -r requirements-train.txt"
        ) from None
    from tomr_fault_diag.training.collect import collect

    recipe = Recipe(epochs=options.epochs)
    between = options.first_seed + options.drives
    train = collect(range(options.first_seed, between), "training drives")
    unseen = collect(range(between, between + options.validation), "validation drives")
    with tqdm(total=recipe.epochs, desc="epochs") as bar:

        def progress(loss: float) -> None:
            bar.set_postfix(loss=f"{loss:.4f}")
            bar.update()

        fitted = fit(train, recipe, progress)
    confusion = confusion_of(fitted.network, unseen.codes, unseen.labels)
    store(fitted.network, options.out)
    drives = {
        "simulator": "tomr_sim_bridge, MuJoCo " + version("mujoco"),
        "training_seeds": [options.first_seed, between - 1],
        "validation_seeds": [between, between + options.validation - 1],
        "training_ticks": len(train.labels),
        "validation_ticks": len(unseen.labels),
    }
    text = json.dumps(_provenance(recipe, drives, fitted, confusion), indent=2)
    options.out.with_suffix(".json").write_text(text + "\n", encoding="utf-8")
    _print(confusion)
    return EXIT_OK


def _provenance(
    recipe: "Recipe", drives: dict[str, object], fitted: "Fitted", confusion: NDArray[np.int64]
) -> dict[str, object]:
    """Where the weights come from, what they reached, and what torch answers with them."""
    return {
        "network": "10-30-6, ReLU, softmax (Wang 2024, section 4)",
        "recipe": asdict(recipe),
        "drives": drives,
        "torch": version("torch"),
        "torch_check": {
            "inputs": fitted.check_inputs.astype(int).tolist(),
            "probabilities": fitted.check_probabilities.astype(float).tolist(),
        },
        "states": [state.name for state in STATES],
        "validation": {
            "accuracy": float(np.trace(confusion) / confusion.sum()),
            "confusion_rows_true": confusion.tolist(),
        },
    }


def confusion_of(
    network: Network, codes: NDArray[np.int8], labels: NDArray[np.int8]
) -> NDArray[np.int64]:
    """Counts of (true state, named state) over ticks, without any filter in time."""
    named = network.probabilities(codes.astype(np.float64)).argmax(axis=1)
    confusion = np.zeros((len(STATES), len(STATES)), dtype=np.int64)
    np.add.at(confusion, (labels.astype(np.int64), named), 1)
    return confusion


def store(network: Network, path: Path) -> None:
    """Write the weights in single precision, as they were trained."""
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez(
        path,
        hidden_weight=network.hidden_weight.astype(np.float32),
        hidden_bias=network.hidden_bias.astype(np.float32),
        output_weight=network.output_weight.astype(np.float32),
        output_bias=network.output_bias.astype(np.float32),
    )


def _print(confusion: NDArray[np.int64]) -> None:
    print(
        f"{'true state':24}" + "".join(f"{n:>9}" for n in range(1, len(STATES) + 1)) + "   recall"
    )
    for number, (state, row) in enumerate(zip(STATES, confusion, strict=True)):
        recall = row[number] / max(row.sum(), 1)
        print(f"{state.name:24}" + "".join(f"{count:9d}" for count in row) + f"   {recall:.3f}")
    print(f"accuracy per tick, unfiltered: {np.trace(confusion) / confusion.sum():.4f}")


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `tomr_train`."""
    return run_main(_train, arguments)
