"""Tables 1 and 2: the paper's network, trained on the six columns of Table 1 as printed."""

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from numpy.typing import NDArray
from table1 import TABLE
from tqdm import tqdm

from figures.page import CODE_COLOURS, INK, page, titled
from figures.result import Missing, Result
from figures.simulated import SENSOR_BANDS, driven, played, reference
from tomr_fault_diag.classifier.states import STATES
from tomr_sim_bridge.missions import load_mission

if TYPE_CHECKING:  # torch is there only where someone trains
    from torch import nn

Array = NDArray[np.float64]

# Wang 2024, section 4.
HIDDEN, LEARNING_RATE, BATCH, EPOCHS = 30, 0.01, 32, 100
# Wang 2024, Table 2: rows are the columns of Table 1, outputs Y1 to Y6.
PRINTED = np.array(
    [
        [0.005, 0.971, 0.002, 0.006, 0.008, 0.006],
        [0.006, 0.003, 0.969, 0.008, 0.007, 0.008],
        [0.001, 0.005, 0.001, 0.987, 0.002, 0.004],
        [0.001, 0.002, 0.002, 0.001, 0.990, 0.004],
        [0.002, 0.004, 0.004, 0.002, 0.003, 0.985],
        [0.981, 0.002, 0.003, 0.001, 0.005, 0.008],
    ]
)
_NAMES = [state.name for state in STATES]
# The order of the columns of Table 1 and of the rows of Table 2.
FAULTS = (*TABLE, "normal")
INPUTS = np.array([*TABLE.values(), (0,) * 10], dtype=np.float64)
TARGETS = np.array([_NAMES.index(name) for name in FAULTS])
SEED, SEEDS = 1, 20
# Drives on which the network of the table is tried: mission and its true state.
_TRIED = (
    ("paper_phases_floor_slippery", "slip"),
    ("paper_phases_control_signal_lost", "control system fault"),
    ("paper_phases_encoder_lost", "motor system fault 1"),
    ("paper_phases", "normal"),
)


def tables(scratch: Path) -> Result:
    """The network of Tables 1 and 2, trained on Table 1 as printed."""
    networks = [trained(seed) for seed in tqdm(range(SEED, SEED + SEEDS), "training", leave=False)]
    answers = np.array([outputs(network, INPUTS) for network in networks])
    ours = answers[0]
    right = answers[:, np.arange(6), TARGETS]
    tried = {mission: _tried(mission, state, networks[0]) for mission, state in _TRIED}
    rows = []
    for row, fault in enumerate(FAULTS):
        for whose, values in (("ours", ours[row]), ("paper", PRINTED[row])):
            largest = _NAMES[int(values.argmax())]
            rows.append((fault, whose, *(f"{value:.3f}" for value in values), largest))
    ranges = f"{right.min():.3f} to {right.max():.3f}, mean {right.mean():.4f}"
    drives = ", ".join(f"{found['state']} {found['right']:.0%}" for found in tried.values())
    return Result(
        "Table 2: outputs of a network trained on Table 1",
        ("column of Table 1", "", "Y1", "Y2", "Y3", "Y4", "Y5", "Y6", "largest"),
        rows,
        {
            "faults": list(FAULTS),
            "outputs": ours.tolist(),
            "printed": PRINTED.tolist(),
            "same_argmax": bool((ours.argmax(axis=1) == PRINTED.argmax(axis=1)).all()),
            "largest_difference": float(np.abs(ours - PRINTED).max()),
            "mean_of_right_outputs": float(right[0].mean()),
            "mean_of_right_outputs_printed": float(PRINTED[np.arange(6), TARGETS].mean()),
            "seeds": SEEDS,
            "seeds_all_right": int((answers.argmax(axis=2) == TARGETS).all(axis=1).sum()),
            "right_output_over_seeds": {
                "least": float(right.min()),
                "mean": float(right.mean()),
                "most": float(right.max()),
            },
            "on_simulated_drives": tried,
        },
        _picture(ours),
        (
            f"right output over {SEEDS} seeds: {ranges}; "
            f"the paper's mean: {PRINTED[np.arange(6), TARGETS].mean():.4f}",
            f"simulated drives, ticks with a code that is not 0, right share: {drives}",
        ),
    )


def trained(seed: int) -> "nn.Sequential":
    """The paper's network and recipe on the six columns. Raises Missing without torch."""
    try:
        import torch
        from torch import nn
    except ModuleNotFoundError as error:
        raise Missing(f"{error.name} is missing: pip install -r requirements-train.txt") from None
    torch.manual_seed(seed)
    torch.set_num_threads(1)
    network = nn.Sequential(nn.Linear(10, HIDDEN), nn.ReLU(), nn.Linear(HIDDEN, 6))
    optimiser = torch.optim.Adam(network.parameters(), lr=LEARNING_RATE)
    loss = nn.CrossEntropyLoss()  # with the softmax in it
    x, y = torch.tensor(INPUTS, dtype=torch.float32), torch.tensor(TARGETS)
    for _ in range(EPOCHS):
        order = torch.randperm(len(x))
        for start in range(0, len(x), BATCH):
            part = order[start : start + BATCH]
            optimiser.zero_grad()
            loss(network(x[part]), y[part]).backward()
            optimiser.step()
    return network


def outputs(network: "nn.Sequential", inputs: Array) -> Array:
    """Softmax outputs (n, 6) for inputs (n, 10)."""
    import torch

    with torch.no_grad():
        answer = network(torch.tensor(inputs, dtype=torch.float32))
        return np.asarray(torch.softmax(answer, dim=1).numpy(), dtype=np.float64)


def _tried(mission: str, state: str, network: "nn.Sequential") -> dict[str, Any]:
    """What the network says of a simulated drive, at the ticks whose codes are not all 0."""
    robot = reference()
    codes = played(driven(load_mission(mission), robot, SEED), robot, SENSOR_BANDS).codes
    codes = codes[codes.any(axis=1)] if state != "normal" else codes
    named = Counter(_NAMES[i] for i in outputs(network, codes.astype(np.float64)).argmax(axis=1))
    count = max(len(codes), 1)
    return {
        "state": state,
        "ticks": len(codes),
        "right": named[state] / count,
        "named": {name: number / count for name, number in named.most_common()},
    }


def _picture(ours: Array) -> Figure:
    figure = page(11.0, 4.3)
    left, middle, right = figure.subplots(1, 3, width_ratios=(0.9, 1, 1))
    _cells(left, INPUTS.T, ListedColormap(CODE_COLOURS), (-1.5, 1.5), "{:.0f}")
    left.set_yticks(range(10), [f"$I_{{{n}}}$" for n in range(1, 11)], fontsize=8)
    targets = [f"$Y_{target + 1}$" for target in TARGETS]
    left.set_xticks(range(6), targets, fontsize=8)
    left.set_xlabel("target output", fontsize=8)
    titled(left, "Table 1: inputs, one column per state")
    for axis, values, title in (
        (middle, PRINTED, "Table 2 as printed"),
        (right, ours, "Our network on Table 1"),
    ):
        _cells(axis, values, "Blues", (0.0, 1.6), "{:.3f}")
        axis.set_xticks(range(6), [f"$Y_{n}$" for n in range(1, 7)], fontsize=8)
        axis.set_yticks(range(6), FAULTS if axis is middle else [], fontsize=8)
        axis.set_xlabel("output", fontsize=8)
        titled(axis, title)
    return figure


def _cells(axis: Axes, values: Array, colours: Any, span: tuple[float, float], form: str) -> None:
    axis.imshow(values, cmap=colours, vmin=span[0], vmax=span[1], aspect="auto")
    for (row, column), value in np.ndenumerate(values):
        colour = "white" if form == "{:.0f}" and value else INK
        text = form.format(value)
        axis.text(column, row, text, ha="center", va="center", fontsize=8, color=colour)
    axis.tick_params(length=0)
    axis.spines[:].set_visible(False)
