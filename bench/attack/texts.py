"""Attacks on descriptions, missions, coefficients, weights, archives, options and command lines."""

import io
import math
import random
import tarfile
from pathlib import Path

import numpy as np
import yaml
from mcap_records import MEGA, channel, chunk, closing, header, indexed, zeros

from attack.case import HEALTHY, NUMBERS, ROOT, VALUES, Attack, Base, attack, reading
from attack.recordings import write
from tomr_power_model.effects import EFFECTS
from tomr_power_model.robot.tables import ROBOT_PARAMETERS
from tomr_power_model.wang2024.coefficients import Coefficients

_ROBOTS = ROOT / "src/tomr_power_model/tomr_power_model/robots"
_WEIGHTS = ROOT / "src/tomr_fault_diag/tomr_fault_diag/weights"
_SHORT = """\
name: short
phases:
  - {twist: [0.2, 0.0, 0.1], duration: 0.2}
  - {move: {heading_deg: 30.0, speed: 0.4, duration: 0.2}}
  - {random: {count: 2, speed: [0.1, 0.2], yaw_rate: 0.5, duration: [0.1, 0.2], pause: 0.1}}
faults:
  - {fault: encoder_lost, start: 0.1, end: 0.3, wheel: 1}
"""


def mutated(text: str, dice: random.Random) -> tuple[str, str]:
    """A YAML text with a value, a line or some letters changed, and what was done."""
    lines = text.splitlines()
    kind = dice.choice(("value", "value", "value", "line", "letters", "bomb", "cut", "swap"))
    at = dice.randrange(len(lines))
    if kind == "value":
        places = [number for number, line in enumerate(lines) if ": " in line]
        at = dice.choice(places or [0])
        key, _, _ = lines[at].partition(": ")
        value = dice.choice(VALUES)
        lines[at] = f"{key}: {value}"
        return "\n".join(lines) + "\n", f"{key.strip()}: {value[:30]!r}"
    if kind == "line":
        lines.insert(at, dice.choice(VALUES)[:2000])
    elif kind == "letters":
        letters = list(text)
        for _ in range(dice.choice((1, 5, 50))):
            letters[dice.randrange(len(letters))] = dice.choice(
                "{}[]:,#&*!|>'\"%@`\n\t\x00 -?aé\ud7ff"
            )
        return "".join(letters), kind
    elif kind == "bomb":
        rows = ["z: &a0 [1, 2, 3, 4, 5, 6, 7, 8]"]
        rows += [f"z{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 8)}]" for n in range(1, 9)]
        indent = dice.choice(("", "    ", "      "))
        lines[at:at] = [indent + row for row in rows]
    elif kind == "cut":
        return text[: dice.randrange(len(text))], kind
    else:
        other = dice.randrange(len(lines))
        lines[at], lines[other] = lines[other], lines[at]
    return "\n".join(lines) + "\n", kind


def described(dice: random.Random) -> tuple[str, str]:
    """A robot.yaml with an odd number at a place where one belongs, or odd as a text."""
    source = dice.choice(sorted(_ROBOTS.iterdir())).read_text("utf-8")
    if dice.random() < 0.5:
        return mutated(source, dice)
    tree = yaml.safe_load(source)
    body = tree["/**"]["ros__parameters"]
    said = []
    for _ in range(dice.choice((1, 1, 2, 4))):
        number = dice.choice(
            (0.0, -1.0, 1e30, 1e-30, 1e-4, 1e3, 1e5, 1e308, 10**40, True, "x", None)
        )
        if dice.random() < 0.4:
            effect = dice.choice(sorted(EFFECTS))
            values: dict[str, object] = dict.fromkeys(EFFECTS[effect].parameters, 0.5)
            values[dice.choice(sorted(values))] = number
            body["physics"][effect] = values
            said.append(f"{effect}: {number}")
            continue
        group = dice.choice(("robot", "motor", "controller", "supply", "sensors"))
        if group not in body:
            continue
        key = dice.choice(sorted(body[group]))
        body[group][key] = dice.choice((number, [number] * 3))
        said.append(f"{group}.{key}: {number}")
    return yaml.safe_dump(tree), ", ".join(said)


def extreme(dice: random.Random) -> tuple[str, str]:
    """A robot.yaml with numbers that are permitted, most of them at the ends of their ranges."""
    tree = yaml.safe_load((_ROBOTS / "reference.yaml").read_text("utf-8"))
    body = tree["/**"]["ros__parameters"]
    said = []
    specs = [spec for spec in ROBOT_PARAMETERS if spec.kind == "float"]
    for spec in dice.sample(specs, dice.choice((1, 2, 4, 12))):
        group, _, key = spec.name.partition(".")
        body[group] = body.get(group, {}) if isinstance(body.get(group, {}), dict) else {}
        body[group][key] = _within(spec.minimum, spec.maximum, dice)
        said.append(f"{spec.name} = {body[group][key]:.3g}")
    for effect in dice.sample(sorted(EFFECTS), dice.choice((0, 0, 1, 3))):
        body["physics"][effect] = {
            name: _within(item.minimum, item.maximum, dice)
            for name, item in EFFECTS[effect].parameters.items()
        }
        said.append(effect)
    return yaml.safe_dump(tree), ", ".join(said)


def _within(low: float, high: float, dice: random.Random) -> float:
    """A number of a range: an end, or any order of magnitude."""
    if dice.random() < 0.3:
        return dice.choice((low, high))
    if low < 0.0:
        return dice.uniform(low, high)
    return math.exp(dice.uniform(math.log(max(low, 1e-6)), math.log(high)))


@attack("extreme robots")
def extremes(dice: random.Random, folder: Path, base: Base) -> Attack:
    return _with_robot(dice, folder, base, *extreme(dice))


@attack("robot.yaml")
def descriptions(dice: random.Random, folder: Path, base: Base) -> Attack:
    return _with_robot(dice, folder, base, *described(dice))


def _with_robot(dice: random.Random, folder: Path, base: Base, text: str, what: str) -> Attack:
    path = folder / dice.choice(("robot.yaml", "<b>.yaml", "a\nb.yaml"))
    path.write_text(text, "utf-8", errors="surrogatepass")
    seconds = [raw for raw in base.healthy if raw.stamp_ns < base.healthy[0].stamp_ns + 3e9]
    bag = write(folder / "bag", seconds)
    if dice.random() < 0.25:
        mission = folder / "short.yaml"
        mission.write_text(_SHORT)
        options = ("--robot", str(path), "--out", str(folder / "out"), "--quiet")
        return Attack("tomr_simulate", (str(mission), *options), what)
    tool, arguments = reading(dice, bag)
    given = [item for item in arguments if item != "reference"]
    if "--robot" in given:
        given.insert(given.index("--robot") + 1, str(path))
    else:
        given += ["--robot", str(path)]
    return Attack(tool, tuple(given), what)


@attack("mission")
def missions(dice: random.Random, folder: Path, base: Base) -> Attack:
    text, what = mutated(_SHORT, dice)
    path = folder / "mission.yaml"
    path.write_text(text, "utf-8", errors="surrogatepass")
    arguments = [str(path), "--out", str(folder / "out"), "--quiet"]
    if dice.random() < 0.2:
        arguments += ["--seed", dice.choice(("0", "-1", "x", "9" * 30, "1e3"))]
    return Attack("tomr_simulate", tuple(arguments), what)


@attack("coefficients")
def coefficients(dice: random.Random, folder: Path, base: Base) -> Attack:
    path = folder / "coefficients.yaml"
    body = "\n".join(f"      {name}: 0.1" for name in Coefficients.__annotations__)
    text = "power_model:\n  ros__parameters:\n    wang2024:\n" + body + "\n"
    for name, value in (("M", "15.0"), ("L_R", "0.2"), ("mu_i", "[0.1, 0.1, 0.1]")):
        text = text.replace(f" {name}: 0.1\n", f" {name}: {value}\n")
    text = text.replace(" P_stanby: 0.1\n", " P_stanby: [1.0, 1.0, 1.0]\n")
    text, what = mutated(text, dice)
    path.write_text(text, "utf-8", errors="surrogatepass")
    bag = write(folder / "bag", base.healthy[:1200])
    arguments = (str(bag), "--json", "--set", "power_model=wang2024")
    return Attack("tomr_diagnose", (*arguments, "--set", f"wang2024.coefficients={path}"), what)


@attack("weights")
def weights(dice: random.Random, folder: Path, base: Base) -> Attack:
    name = dice.choice(("window", "wang2024"))
    path = folder / "weights.npz"
    source = dice.choice(sorted(_WEIGHTS.glob("*.npz")))
    kind = dice.choice(("bytes", "bytes", "bare", "shape", "huge", "nan", "type", "cut", "device"))
    data = bytearray(source.read_bytes())
    if kind == "bytes":
        for _ in range(dice.choice((1, 10, 200))):
            data[dice.randrange(len(data))] = dice.randrange(256)
    elif kind == "cut":
        del data[dice.randrange(len(data)) :]
    if kind in ("bytes", "cut"):
        path.write_bytes(data)
    elif kind == "bare":
        with path.open("wb") as file:
            np.save(file, np.zeros(dice.choice((0, 3, 1000))))
    elif kind == "device":
        path.symlink_to(dice.choice(("/dev/zero", "/dev/full", str(folder))))
    else:
        with np.load(source) as stored:
            arrays = dict(stored)
        key = dice.choice(sorted(arrays))
        arrays[key] = {
            "shape": np.zeros(dice.choice(((0,), (3, 3, 3), (1,), ()))),
            "huge": np.zeros(12_000_000),
            "nan": np.full(arrays[key].shape, dice.choice((np.nan, np.inf, 1e308))),
            "type": np.array(dice.choice((["a"], [1j], [None], [b"x"]))),
        }[kind]
        with path.open("wb") as file:
            np.savez_compressed(file, **arrays)
    bag = write(folder / "bag", base.healthy[:1200])
    options = ("--set", f"classifier={name}", "--set", f"weights={path}")
    return Attack("tomr_diagnose", (str(bag), "--json", *options), f"{kind} of {source.name}")


@attack("options")
def options(dice: random.Random, folder: Path, base: Base) -> Attack:
    from tomr_fault_diag.diagnosis.settings import PARAMETERS

    bag = write(folder / "bag", base.healthy[:1200])
    given: list[str] = []
    for _ in range(dice.choice((1, 2))):
        name = dice.choice((*PARAMETERS, "x", "", "robot.mass"))
        value = dice.choice((*VALUES, *NUMBERS, "0.1", "1.0", "50"))[:5000].replace("\x00", "")
        given += ["--set", name + dice.choice(("=", "=", "=", "", "==")) + value]
    return Attack("tomr_diagnose", (str(bag), "--json", *given), " ".join(given)[:60])


_WORDS = {
    "tomr_diagnose": ("--robot", "--out", "--namespace", "--set", "--json", "--parameters"),
    "tomr_calibrate": (
        *("--robot", "--out", "--holdout", "--report", "--fit", "--shared", "--tolerance"),
        *("--skip", "--power-window", "--encoder-window", "--squares", "--namespace"),
    ),
    "tomr_gap": (
        *("check", "explain", "--robot", "--real", "--sim", "--holdout", "--skip", "--tolerance"),
        *("--quiet", "--out", "--suggest"),
    ),
    "tomr_simulate": ("--out", "--robot", "--seed", "--storage", "--picture", "--list", "--quiet"),
    "tomr_import_robotino": ("--out", "--surface", "--storage"),
    "tomr_commission": (
        *("plan", "--robot", "--out", "--false-alarms-per-hour", "--tolerance", "--skip"),
        *("--quiet", "--speed", "--help"),
    ),
    "tomr_odometry": (
        *("--robot", "--out", "--reference", "--namespace", "--set", "--parameters", "--json"),
        *("learn", "--quiet", "--help"),
    ),
    "tomr_train": (
        *("--out", "--classifier", "--bands", "--drives", "--validation", "--first-seed"),
        *("--epochs", "--help"),
    ),
}


_READING = ("tomr_calibrate", "tomr_commission", "tomr_odometry")


@attack("command line")
def command_lines(dice: random.Random, folder: Path, base: Base) -> Attack:
    tool = dice.choice(sorted(_WORDS))
    bag = write(folder / "bag", base.healthy[:600])
    values: tuple[str, ...] = (
        *(str(bag), str(folder), "reference", "nowhere", "", "-", "/dev/null", "/dev/zero", "."),
        *("robot.mass", "robot.mass=0.1", "robot.mass=nan", "bag=0:1", "bag=9:1", "bag=inf:nan"),
        *("all", "-1", "1e308", "nan", "mcap", "a\nb", "\x1b[31m", "x" * 5000, str(folder / "new")),
    )
    arguments: list[str] = []
    if tool == "tomr_gap":
        arguments.append(dice.choice(("check", "explain")))
    for _ in range(dice.randrange(7)):
        arguments.append(dice.choice((*_WORDS[tool], *values)))
    if tool in _READING and dice.random() < 0.5:  # get beyond the parser
        arguments[:0] = [str(bag), "--robot", "reference", "--out", str(folder / "made")]
    if tool == "tomr_train":  # it would take minutes
        arguments += ["--drives", dice.choice(("0", "-1", "1e308", "nan"))]
    return Attack(tool, tuple(arguments), " ".join(arguments)[:60])


@attack("bombs")
def bombs(dice: random.Random, folder: Path, base: Base) -> Attack:
    packing, size = dice.choice(("zstd", "lz4")), dice.choice((100, 500, 3000)) * MEGA
    if packing == "lz4":
        size = min(size, 500 * MEGA)  # packs worse
    stated = dice.choice((size, 1000, 2**62, 50 * MEGA))
    metadata = dice.choice((b"", b"\xff" * 100, b"\x04\0\0\0aaaa\x04\0\0\0[[[["))
    head = header() + channel("/joint_states", "sensor_msgs/msg/JointState", metadata=metadata)
    bomb = chunk(packing, zeros(packing, size), stated)
    path = folder / "bomb.mcap"
    if dice.random() < 0.5:
        path.write_bytes(indexed(head, [(bomb, stated, 0, 9)] * dice.choice((1, 40)), packing))
    else:
        path.write_bytes(head + bomb * dice.choice((1, 40)) + closing())
    tool, arguments = reading(dice, path)
    return Attack(tool, arguments, f"{packing}, {size // MEGA} MB stated as {stated}")


@attack("data set")
def archives(dice: random.Random, folder: Path, base: Base) -> Attack:
    names = "t;xsetspeed;ysetspeed;setvel;m1setvel;m2setvel;m3setvel;m1pos;m2pos;m3pos;"
    names += "m1vel;m2vel;m3vel;m1cur;m2cur;m3cur;xpos;ypos;ang;"
    units = "ms;m/s;m/s;rad/s;rad/s;rad/s;rad/s;ticks;ticks;ticks;rad/s;rad/s;rad/s;A;A;A;"
    units += "pix;pix;deg;"
    rows = [f"{30 * n};" + "0.1;" * 18 for n in range(20)]
    cells = rows[at := dice.randrange(20)].split(";")
    number = dice.choice(("nan", "inf", "1e308", "-1e300", "x", "", "1e11", "9" * 400, "\x00", "é"))
    cells[dice.randrange(18)] = number
    rows[at] = ";".join(cells)
    text = "\n".join([names, units, names, *rows]) + "\n"
    if dice.random() < 0.3:
        text = text[: dice.randrange(len(text))]
    data = text.encode()
    archive = folder / "data.tar.gz"
    name = dice.choice(
        ("gray_surface/a.csv", "../a.csv", "/a.csv", "a\nb/c.csv", "x" * 300 + ".csv")
    )
    with tarfile.open(archive, "w:gz") as tar:
        member = tarfile.TarInfo(name)
        member.size = len(data)
        tar.addfile(member, io.BytesIO(data))
        if dice.random() < 0.3:
            link = tarfile.TarInfo("gray_surface/b.csv")
            link.type, link.linkname = tarfile.SYMTYPE, "/etc/passwd"
            tar.addfile(link)
        if dice.random() < 0.1:
            large = tarfile.TarInfo("zeros.csv")
            large.size = 700 * MEGA
            tar.addfile(large, _Zeros())
    if dice.random() < 0.3:
        packed = bytearray(archive.read_bytes())
        packed[dice.randrange(len(packed))] ^= 1 << dice.randrange(8)
        archive.write_bytes(packed[: dice.choice((len(packed), dice.randrange(len(packed))))])
    out = folder / "out"
    return Attack(
        "tomr_import_robotino", (str(archive), "--out", str(out)), f"{name[:20]}: {number[:9]}"
    )


class _Zeros:
    def read(self, size: int = -1) -> bytes:
        return bytes(size)


@attack("full disks and signals")
def ends(dice: random.Random, folder: Path, base: Base) -> Attack:
    limit = dice.choice((None, 0, 1000, 20_000, 100_000))
    signal_after = None if limit is not None else dice.choice((0.05, 0.3, 0.6, 1.0, 2.0, 4.0))
    kind = dice.choice(("diagnose", "simulate", "simulate", "calibrate"))
    out, page = folder / "out", folder / "page.html"
    if kind == "simulate":
        mission = folder / "short.yaml"
        mission.write_text(_SHORT)
        storage = dice.choice(("mcap", "sqlite3"))
        arguments: tuple[str, ...] = (str(mission), "--out", str(out), "--storage", storage)
        arguments += ("--quiet",)
    elif kind == "diagnose":
        bag = write(folder / "bag", base.healthy[:3000])
        arguments = (str(bag), "--out", str(out))
    else:
        for path in (out, page):
            path.write_text("old")
        arguments = (str(HEALTHY), "--robot", "reference", "--fit", "robot.mass")
        arguments += ("--out", str(out), "--report", str(page))
    what = f"{limit} bytes" if limit is not None else f"SIGTERM after {signal_after} s"
    return Attack(
        f"tomr_{kind}",
        arguments,
        what,
        outputs=(out, page) if kind == "calibrate" else (out,),
        largest_file=limit,
        signal_after=signal_after,
    )
