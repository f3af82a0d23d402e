"""Attacks on what describes recordings or robots: metadata.yaml, sqlite3 tables, commissioning."""

import random
import sqlite3
from pathlib import Path

import yaml

from attack.case import VALUES, Attack, Base, attack, reading
from attack.recordings import write
from attack.texts import mutated
from tomr_power_model.robot import COMMISSIONING, digest_of, shipped_robot
from tomr_power_model.robot.files import read_sections

_PATHS = (
    *("../bag.mcap", "/etc/passwd", "/dev/zero", "../../../../../../etc/passwd", "a\nb", "", "."),
    *("bag.mcap/x", "~/bag.mcap", "\x00", "bag.mcap" * 100, "link.mcap", "../out/bag.mcap", "-x"),
)
_FIELDS = (
    *("version", "storage_identifier", "message_count", "compression_format", "compression_mode"),
    *("duration", "starting_time", "topics_with_message_count", "relative_file_paths", "files"),
)
_ODD: tuple[object, ...] = (
    *(-1, 0, 99, 2**63, 1e308, None, "", "zstd", "FILE", "MESSAGE", "sqlite3", [], {}, [None]),
    *(
        [{"path": "/etc/passwd"}],
        {"nanoseconds": -1},
        {"nanoseconds_since_epoch": 2**70},
        "x" * 9000,
    ),
)


@attack("metadata")
def metadata(dice: random.Random, folder: Path, base: Base) -> Attack:
    bag = write(folder / "bag", base.healthy[:1200], dice.choice(("mcap", "sqlite3")))
    place = bag / "metadata.yaml"
    kind = dice.choice(("text", "text", "path", "field", "field", "link", "large"))
    what = kind
    if kind == "text":
        text, what = mutated(place.read_text(), dice)
        place.write_text(text, "utf-8", errors="surrogatepass")
    elif kind == "link":
        place.unlink()
        place.symlink_to(dice.choice(("/dev/zero", "/dev/full", "metadata.yaml", "/etc/passwd")))
    elif kind == "large":
        place.write_text(place.read_text() + "# " + "x" * dice.choice((10**5, 10**7)))
    else:
        tree = yaml.safe_load(place.read_text())
        body = tree["rosbag2_bagfile_information"]
        if kind == "path":
            what = dice.choice(_PATHS)
            (bag / "link.mcap").symlink_to("/etc/passwd")
            body["relative_file_paths"] = dice.choice(([what], [what] * 2, ["bag.mcap", what]))
            if dice.random() < 0.3:
                body.update(compression_format="zstd", compression_mode="FILE")
        else:
            name, value = dice.choice(_FIELDS), dice.choice(_ODD)
            body[name] = value
            what = f"{name}: {value!r}"[:60]
        place.write_text(yaml.safe_dump(tree))
    tool, arguments = reading(dice, bag)
    return Attack(tool, arguments, what)


_STATEMENTS = (
    "UPDATE messages SET timestamp = {value} WHERE id % {n} = 0",
    "UPDATE messages SET data = {value} WHERE id % {n} = 0",
    "UPDATE messages SET topic_id = {value} WHERE id % {n} = 0",
    "UPDATE messages SET data = zeroblob({large}) WHERE id % {n} = 0",
    "UPDATE topics SET type = {value} WHERE id % 3 = 0",
    "UPDATE topics SET name = {value} WHERE id % 3 = 0",
    "UPDATE topics SET serialization_format = {value}",
    "UPDATE topics SET name = '/joint_states'",
    "UPDATE message_definitions SET encoded_message_definition = {value}",
    "DELETE FROM topics WHERE id % 2 = 0",
    "DELETE FROM message_definitions",
    "DROP TABLE {table}",
    "ALTER TABLE messages RENAME COLUMN data TO stuff",
    "DROP TABLE messages; CREATE VIEW messages AS SELECT 1 AS id, 1 AS topic_id, 1 AS timestamp, "
    "zeroblob({large}) AS data",
    "DROP TABLE messages; CREATE VIEW messages AS WITH RECURSIVE r(i) AS (SELECT 1 UNION ALL "
    "SELECT i + 1 FROM r) SELECT i AS id, 1 AS topic_id, i AS timestamp, x'00' AS data FROM r",
    "CREATE TRIGGER t AFTER DELETE ON messages BEGIN DELETE FROM topics; END",
    "UPDATE schema SET schema_version = {value}",
    "UPDATE metadata SET metadata = {value}",
    "PRAGMA user_version = 99; PRAGMA application_id = 1",
    "INSERT INTO topics SELECT id + 100, name, {value}, serialization_format, "
    "offered_qos_profiles, type_description_hash FROM topics",
)
_SQL = (
    "NULL",
    "'x'",
    "-1",
    "9223372036854775807",
    "1e308",
    "x''",
    "x'00'",
    "'a' || char(10)",
    "''",
)


@attack("tables of sqlite3")
def tables(dice: random.Random, folder: Path, base: Base) -> Attack:
    bag = write(folder / "bag", base.healthy[:1200], "sqlite3")
    said: list[str] = []
    store = sqlite3.connect(bag / "bag.db3")
    for _ in range(dice.choice((1, 1, 2))):
        statement = dice.choice(_STATEMENTS).format(
            value=dice.choice(_SQL),
            n=dice.choice((1, 2, 50)),
            large=dice.choice((1000, 10**6, 10**8)) if "VIEW" in str(said) else 10**6,
            table=dice.choice(("messages", "topics", "schema", "metadata", "message_definitions")),
        )
        said.append(statement)
        try:
            store.executescript(statement)
            store.commit()
        except sqlite3.Error:  # a table that the first statement took away
            continue
    store.close()
    if dice.random() < 0.5:
        (bag / "metadata.yaml").unlink()
    tool, arguments = reading(dice, bag)
    return Attack(tool, arguments, "; ".join(said)[:100])


@attack("commissioned files")
def commissioned(dice: random.Random, folder: Path, base: Base) -> Attack:
    sections = {name: dict(flat) for name, flat in read_sections("reference").items()}
    record: dict[str, object] = {
        "date": "2026-01-01", "version": "1.0", "robot": "reference", "verdict": "go",
        "drives": ["a", "b"], "held_out": "b", "method": "explained",
        "false_alarms_per_hour": 0.05, "expected_false_alarms_per_hour": 0.04,
        "floors.slip": 0.3, "description": digest_of(shipped_robot("reference")),
    }  # fmt: skip
    bands = {f"band.{name}": 0.5 for name in ("total", "motor", "wheel", "x")}
    given: dict[str, dict[str, object]] = {
        "power_residuals": {name: value for name, value in bands.items() if dice.random() < 0.1},
        "fault_classifier": {"classifier": "window", "caution": 3.0, "commissioned": "2026 x"},
        COMMISSIONING: record,
    }
    section = given[dice.choice(sorted(given))]
    what = "as it is"
    if section and dice.random() < 0.5:
        key = dice.choice(sorted(section))
        section[key] = dice.choice(_ODD)
        what = f"{key}: {section[key]!r}"[:60]
    tree = {name: {"ros__parameters": flat} for name, flat in {**sections, **given}.items()}
    text = yaml.safe_dump(tree)
    if what == "as it is" and dice.random() < 0.9:
        text, what = (
            mutated(text, dice) if dice.random() < 0.8 else (dice.choice(VALUES), "a value")
        )
    path = folder / "commissioned.yaml"
    path.write_text(text, "utf-8", errors="surrogatepass")
    bag = write(folder / "bag", base.healthy[:1200])
    return Attack("tomr_diagnose", (str(bag), "--robot", str(path), "--json"), what)
