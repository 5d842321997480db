"""Seeded mutations of a vehicle's files: what a person, a spreadsheet or another program does to them by mistake."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from pathlib import Path
from random import Random

KINDS = ("unit", "sign", "swap", "duplicate", "missing", "shift", "type", "text")
FACTORS = (1e3, 1e-3, 57.29578, 1 / 57.29578, 0.3048, 1 / 0.3048, 4.448222, 0.4535924, 9.80665, 1e6, 1e-6)
CELLS = (
    "",
    "x",
    "nan",
    "inf",
    "-inf",
    "1e308",
    "1e400",
    "1,5",
    "true",
    "0x10",
    "1_000",
    "９",
    "-",
    "9" * 5000,
    '"',
    "--1",
)
VALUES = (
    *(
        "true",
        "false",
        '"0.005"',
        '""',
        "[]",
        "{}",
        "nan",
        "inf",
        "-1",
        "0",
        "1e308",
        "9" * 5000,
        "[1, 2]",
        '"\\u0000"',
    ),
    *('"../x"', "1979-05-27", "-0.0", '"$x_{$"', '"[/red]"', "[[[]]]", "{ a = 1 }", '"*/ /*"', '"' + "x" * 5000 + '"'),
)
TEXTS = (
    "\0",
    "\ufeff",
    '"',
    "'",
    ";",
    "\t",
    "\r",
    "\u2028",
    "[",
    "]",
    "{",
    "=",
    "#",
    ",",
    "\ud7ff",
    "é",
    "\\",
    "[[x]]\n",
)
NUMBER = re.compile(r"(?<![\w.\"])[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?(?![\w\"])")


@dataclass(frozen=True)
class Mutation:
    """What was done, to which file, and to which of its columns or keys."""

    kind: str
    file: str
    place: str
    what: str


def mutate(folder: Path, file: str, kind: str, random: Random) -> Mutation | None:
    """Change one file of a folder; None where it has nothing for this kind."""
    path = folder / file
    if kind == "text":
        place, what = _spoil_text(path, random)
    elif file.endswith(".csv"):
        place, what = _spoil_table(path, kind, random)
    else:
        place, what = _spoil_keys(path, kind, random)
    return Mutation(kind, file, place, what) if what else None


def _spoil_text(path: Path, random: Random) -> tuple[str, str]:
    content = path.read_bytes()
    text = content.decode()
    match random.randrange(6):
        case 0:
            encoding = random.choice(("utf-16", "utf-16-le", "utf-32", "utf-8-sig", "cp037"))
            path.write_bytes(text.encode(encoding))
            return "", f"encoded as {encoding}"
        case 1:
            at = random.randrange(len(content))
            path.write_bytes(content[:at])
            return "", f"cut at byte {at}"
        case 2:
            at, inserted = random.randrange(len(text)), random.choice(TEXTS)
            path.write_text(text[:at] + inserted + text[at:], encoding="utf-8")
            return "", f"{inserted!r} at character {at}"
        case 3:
            at = random.randrange(len(content))
            path.write_bytes(content[:at] + bytes([random.randrange(256)]) + content[at + 1 :])
            return "", f"byte {at} replaced"
        case 4:
            mark = random.choice((";", "\t", "|", ", ,", ",\n"))
            path.write_text(text.replace(",", mark), encoding="utf-8")
            return "", f"commas replaced by {mark!r}"
        case _:
            path.write_text("# " + "x" * 200_000 + "\n" + text, encoding="utf-8")
            return "comment", "a comment of 200 000 characters"


def _spoil_table(path: Path, kind: str, random: Random) -> tuple[str, str]:
    lines = path.read_text(encoding="utf-8").splitlines()
    comments = [line for line in lines if line.startswith("#")]
    rows = list(csv.reader(line for line in lines if line and not line.startswith("#")))
    if any(len(row) != len(rows[0]) for row in rows) or len(rows) < 4:
        return "", ""
    header, body = rows[0], rows[1:]
    numeric = [j for j, cell in enumerate(header) if "[" in cell]
    j = random.choice(numeric)
    place, what = header[j].split("[")[0].strip(), ""

    def change(function) -> None:
        for row in body:
            row[j] = repr(function(float(row[j])))

    if kind == "unit":
        factor = random.choice(FACTORS)
        change(lambda x: factor * x)
        what = f"times {factor:g}"
    elif kind == "sign":
        change(lambda x: -x)
        what = "negative"
    elif kind == "swap" and random.random() < 0.7 and len(numeric) > 1:
        k = random.choice([k for k in numeric if k != j])
        for row in body:
            row[j], row[k] = row[k], row[j]
        what = f"values swapped with {header[k].split('[')[0].strip()}"
    elif kind == "swap":
        a, b = random.sample(range(len(body)), 2)
        body[a], body[b] = body[b], body[a]
        place, what = "rows", f"rows {a} and {b} swapped"
    elif kind == "duplicate" and random.random() < 0.5:
        a = random.randrange(len(body))
        body.insert(a, list(body[a]))
        place, what = "rows", f"row {a} twice"
    elif kind == "duplicate":
        for row in rows:
            row.append(row[j])
        what = "column twice"
    elif kind == "missing" and random.random() < 0.4:
        for row in rows:
            del row[j]
        what = "column missing"
    elif kind == "missing":
        count = max(1, int(len(body) * random.choice((0.02, 0.3, 0.6, 0.95))))
        first = random.choice((0, len(body) - count, random.randrange(len(body) - count + 1)))
        del body[first : first + count]
        place, what = "rows", f"rows {first} to {first + count - 1} of {len(body) + count} missing"
    elif kind == "shift" and random.random() < 0.5:
        step = random.choice((-1, 1)) * random.choice((1, max(1, len(body) // 4)))
        values = [row[j] for row in body]
        for i, row in enumerate(body):
            row[j] = values[min(max(i + step, 0), len(body) - 1)]
        what = f"shifted by {step} rows"
    elif kind == "shift":
        j = numeric[0]
        span = float(body[-1][j]) - float(body[0][j])
        offset = random.choice((-1, 1)) * random.choice((0.05, 0.3, 2.0)) * span
        change(lambda x: x + offset)
        place, what = header[j].split("[")[0].strip(), f"plus {offset:g}"
    elif kind == "type":
        a, cell = random.randrange(len(body)), random.choice(CELLS)
        body[a][j] = cell
        what = f"row {a} is {cell[:20]!r}"
    with path.open("w", encoding="utf-8", newline="") as file:
        file.writelines(f"{line}\n" for line in comments)
        csv.writer(file, lineterminator="\n").writerows([header, *body])
    return place, what


def _spoil_keys(path: Path, kind: str, random: Random) -> tuple[str, str]:
    """Change a TOML (or JSON) file by its lines, so that the rest stays as it was written."""
    lines = path.read_text(encoding="utf-8").splitlines()
    separator = ":" if path.suffix == ".json" else "="
    keyed = [i for i, line in enumerate(lines) if re.match(rf'\s*["\w.-]+\s*{separator}\s', line)]
    values = {i: lines[i].partition(separator)[2].partition(" #")[0] for i in keyed}
    numbered = [i for i, value in values.items() if NUMBER.search(value) and not value.lstrip().startswith('"')]
    heads = [i for i, line in enumerate(lines) if line.startswith("[")] + [len(lines)]
    i = random.choice(numbered if kind in ("unit", "sign", "shift") and numbered else keyed)
    head, mark, tail = lines[i].partition(separator)
    place, what = _place(lines, i), ""
    value, *_ = tail.partition(" #")
    found = list(NUMBER.finditer(value))
    if kind in ("unit", "sign", "shift") and found:
        each = random.random() < 0.5
        one = random.choice(found)
        factor, offset = {
            "unit": (random.choice(FACTORS), 0.0),
            "sign": (-1.0, 0.0),
            "shift": (1.0, random.choice((-1, 1)) * random.choice((0.1, 1.0, 10.0, 1e3))),
        }[kind]
        changed = NUMBER.sub(
            lambda m: repr(factor * float(m[0]) + offset) if each or m.start() == one.start() else m[0], value
        )
        lines[i] = f"{head}{mark}{changed}"
        what = f"{value.strip()[:40]} becomes {changed.strip()[:40]}"
    elif kind == "swap" and len(keyed) > 1:
        k = random.choice([k for k in keyed if k != i])
        other = lines[k].partition(separator)
        lines[i], lines[k] = f"{head}{mark}{other[2]}", f"{other[0]}{other[1]}{tail}"
        what = f"value swapped with {_place(lines, k)}"
    elif kind == "duplicate" and random.random() < 0.4:
        lines.insert(i, lines[i])
        what = "key twice"
    elif kind in ("duplicate", "missing") and len(heads) > 1:
        k = random.randrange(len(heads) - 1)
        block = lines[heads[k] : heads[k + 1]]
        place = block[0].strip()
        if kind == "duplicate":
            lines[heads[k + 1] : heads[k + 1]] = block
            what = "section twice"
        else:
            del lines[heads[k] : heads[k + 1]]
            what = "section missing"
    elif kind in ("missing", "duplicate"):
        del lines[i]
        what = "key missing"
    elif kind == "type":
        new = random.choice(VALUES)
        lines[i] = f"{head}{mark} {new}" + ("," if tail.rstrip().endswith(",") and separator == ":" else "")
        what = f"is {new[:30]}"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return place, what


def _place(lines: list[str], i: int) -> str:
    key = re.split(r"[=:]", lines[i])[0].strip().strip('"')
    section = next((line.strip("[] \n").partition("]")[0] for line in reversed(lines[:i]) if line.startswith("[")), "")
    return f"{section}.{key}" if section else key
