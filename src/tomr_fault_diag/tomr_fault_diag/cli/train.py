"""`tomr_train`: train the network on simulated drives and store it with its provenance."""

import argparse
import json
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

import numpy as np
from tqdm import tqdm

from tomr_fault_diag.classifier.network import Network
from tomr_fault_diag.classifier.states import STATES
from tomr_power_model.cli import EXIT_OK, run_main
from tomr_power_model.errors import InputError

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
    network = fitted.network
    confusion = confusion_of(network, unseen.codes, unseen.labels)
    store(network, options.out)
    provenance = {
        "network": "10-30-6, ReLU, softmax (Wang 2024, section 4)",
        "recipe": {
            "learning_rate": recipe.learning_rate,
            "batch": recipe.batch,
            "epochs": recipe.epochs,
            "seed": recipe.seed,
            "silent": recipe.silent,
            "blinded": recipe.blinded,
        },
        "drives": {
            "simulator": "tomr_sim_bridge, MuJoCo " + version("mujoco"),
            "training_seeds": [options.first_seed, between - 1],
            "validation_seeds": [between, between + options.validation - 1],
            "training_ticks": len(train.labels),
            "validation_ticks": len(unseen.labels),
        },
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
    options.out.with_suffix(".json").write_text(
        json.dumps(provenance, indent=2) + "\n", encoding="utf-8"
    )
    _print(confusion)
    return EXIT_OK


def confusion_of(
    network: Network, codes: np.typing.NDArray[np.int8], labels: np.typing.NDArray[np.int8]
) -> np.typing.NDArray[np.int64]:
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


def _print(confusion: np.typing.NDArray[np.int64]) -> None:
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
