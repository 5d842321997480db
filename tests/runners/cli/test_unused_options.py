"""Options that would change nothing are refused, in every command."""

from __future__ import annotations

import pytest
import typer
from typer.core import TyperGroup
from typer.testing import CliRunner

from ascentwind.model.errors import AscentwindError
from ascentwind.runners.cli.app import app

SOUNDINGS = ["--soundings", "none.csv"]
APPLY = ["wind", "apply", ".", "--component", "zonal", "--azimuth", "0", "--site", "x"]
LAUNCH = ["day-of-launch", "as504", "--sounding", "s.csv", "--hours-before", "3", "--limit", "limit.csv"]
DESIGN = """format = 1
vehicle = "as504"
times = "70,75"
[parameters]
"control.T1.gain" = [0.9, 1.1]
"""

FRAME = ("json", "as_json")  # of every command, by its frame

# what is typed, and what must be said
UNUSED = [
    *(
        (["wind", *command, *SOUNDINGS, *option], f"{option[0]} is not used with --soundings")
        for command in (["stats"], ["fit"], ["check", "{filter}"], ["plot", "{filter}"])
        for option in (["--period", "march"], ["--edition", "1983"])
    ),
    (["wind", "fit", "--method", "linear-regression", "--time-limit", "9"], "--time-limit is not used by linear"),
    (["wind", "fit", "--method", "impulse-response", "--noises", "2"], "makes filters of one noise"),
    (["wind", "stats", "--top", "50000"], "50000 m is not among them"),
    (APPLY, "--site is not used without --soundings"),
    ([*APPLY[:-2], "--samples", "80"], "--samples is not used without --matrix"),
    ([*APPLY[:-2], "--repair"], "--repair is not used without --matrix"),
    ([*APPLY, "--matrix", "m.csv", "--edition", "2006"], "--edition is not used with --matrix"),
    ([*APPLY, "--matrix", "m.csv", *SOUNDINGS], "--soundings is not used with --matrix"),
    ([*APPLY, *SOUNDINGS, "--period", "may"], "--period is not used with --soundings"),
    ([*APPLY, *SOUNDINGS, "--edition", "2006"], "--edition is not used with --soundings"),
    (["wind", "stats", "--normality", "here"], "--normality is not used without --soundings"),
    (["availability", "as504", "--limit", "l.csv", "--threshold", "0.1"], "--threshold is not used without --check"),
    (["wind", "months", "--out", "here", "--site", "x"], "--site is not used without --soundings"),
    (["wind", "months", "--out", "here", "--soundings", "s.csv", "--edition", "2006"], "--edition is not used with"),
    ([*LAUNCH, "--sign", "-1"], "--sign is not used without --component"),
    ([*LAUNCH, "--exponent", "1"], "--exponent is not used without --lasts"),
    ([*LAUNCH, "--lasts", "50", "--pairs", "p.csv"], "--pairs and --lasts both say"),
    (["fly", "as504", "none.csv", "--sign", "-1"], "--sign is not used without --component"),
    (["wind", "read", "none.csv", "--point", "bilinear"], "--point is not used without --latitude"),
    (["equations", "as504", "--page", "p.md", "--of", "4-1"], "--of is not used with --page"),
    (["equations", "as504", "--page", "p.md", "--of", "4-1", "--by", "mass"], "not used with --page"),
    (["equations", "as504", "--by", "mass"], "--by mass needs --of"),
    (["sensitivity", "as504", "--quantity", "mean", "--source", "wind"], "--source is not used with --quantity mean"),
    (["design", "design.toml", "--trade"], "--trade is not used with design.toml, which has no"),
    (["design", "design.toml", "--no-trade"], "not used with design.toml, which has no"),
    (["run", "as504", "--engine", "sweep", "--method", "bdf"], "engine 'sweep' takes no method"),
    (["run", "as504", "--engine", "covariance", "--method", "bdf"], "engine 'covariance' takes no method"),
    (["run", "as504", "--engine", "ensemble", "--tolerance", "1e-6"], "engine 'ensemble' takes no relative tolerance"),
    (["run", "as504", "--times", "70", "--set", 'default_times="80"'], "--set default_times is not used with --times"),
    *(
        ([*command, "--set", 'default_times="80"'], "--set default_times is not used here")
        for command in (
            ["verify", "as504", "--times", "70"],
            ["tolerance", "as504"],
            ["sensitivity", "as504", "--time", "75"],
            ["equations"],
            ["inspect", "as504", "--time", "70"],
            ["mean", "as504"],
            ["design", "design.toml"],
            ["regenerate", "as504"],
            ["wind", "compare", "as504"],
        )
    ),
    (["run", "as504", "--turbulence", "light", "--set", 'wind.turbulence.severity="severe"'], "two severities"),
    (["sensitivity", "as504", "--set", "weighting_times_s=[70]"], "--set weighting_times_s is not used here"),
    (["regenerate", "--set", "options.slosh_reaction=true"], "--set needs a vehicle"),
    (["run", "as504", "--set", 'wind.correlation.source="x"'], 'used with wind.synthesis = "closed_form"'),
    (
        ["run", "as504", "--set", 'wind.synthesis="closed_form"', "--set", 'wind.filter="x.json"'],
        'used with wind.synthesis = "fitted"',
    ),
    (["run", "as504", "--set", 'loads.0.local.interpolation="linear"'], "options.local_angle_of_attack = true"),
    (["run", "as504", "--set", 'tables.local_aerodynamics.source="x"'], "options.local_angle_of_attack = true"),
]

# Options of every command: an option that is not here must be looked at, whether some other one makes it idle
KNOWN = {
    "run": {
        "system", "times", "out", "engine", "method", "tolerance", "turbulence", "changes", "along_vehicle",
        "probability", "azimuths", "report",
    },
    "report": {"out"},
    "flight-load": {
        "window", "response", "probability", "limit", "sides", "sensitivity", "wind_error", "draws", "seed", "out",
        "turbulence", "changes",
    },
    "gust": {"shape", "response", "amplitude", "length", "times", "out", "turbulence", "changes"},
    "fly": {"times", "response", "levels", "component", "sign", "out", "changes"},
    "export": {"format", "out", "times", "turbulence", "changes"},
    "day-of-launch": {
        "sounding", "hours_before", "limit", "window", "threshold", "error", "pairs", "lasts", "exponent", "sides",
        "component", "sign", "draws", "seed", "out", "changes",
    },
    "availability": {
        "limit", "months", "azimuths", "winds", "window", "check_hours", "threshold", "sides", "draws", "seed", "out",
        "changes",
    },
    "vehicles": set(),
    "new-vehicle": {"source", "name", "title", "site", "azimuth", "month"},
    "inspect": {"time", "changes"},
    "regenerate": {"out", "changes"},
    "doctor": set(),
    "cache": {"clean"},
    "verify": {"times", "runs", "seed", "out", "turbulence", "changes"},
    "tolerance": {"times", "out", "changes"},
    "sensitivity": {"response", "time", "source", "quantity", "probability", "out", "turbulence", "changes"},
    "equations": {"of", "by", "page", "changes"},
    "study": {"changes", "out", "scheduler"},
    "mean": {"out", "changes"},
    "design": {"out", "trades", "changes"},
    "reproduce": {"out"},
    "import-structure": {"out"},
    "build-vehicle": {"out", "figures", "spacing"},
    "wind apply": {
        "component", "components", "azimuth", "sign", "period", "edition", "soundings", "site", "matrix",
        "samples", "repair",
    },
    "wind read": {
        "levels", "months", "hours", "years", "latitude", "longitude", "point", "largest_gap", "incomplete", "outliers",
        "out",
    },
    "wind months": {"out", "edition", "soundings", "site", "chosen"},
    "wind stats": {"period", "component", "edition", "top", "soundings", "normality"},
    "wind fit": {
        "period", "component", "edition", "top", "soundings", "method", "order", "noises", "time_limit", "out",
    },
    "wind check": {"period", "component", "edition", "top", "soundings", "profiles"},
    "wind plot": {"period", "component", "edition", "top", "soundings", "vehicle", "out"},
    "wind compare": {"time", "response", "changes"},
}  # fmt: skip


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder of its own to run in, and a filter."""
    from ascentwind.model.vehicle.shipped import built_in_vehicles

    monkeypatch.chdir(tmp_path)
    (tmp_path / "design.toml").write_text(DESIGN)
    return str(built_in_vehicles()["as504"] / "wind_march_zonal_filter.json")


@pytest.mark.parametrize(("arguments", "says"), UNUSED, ids=lambda x: " ".join(x) if isinstance(x, list) else "")
def test_an_option_that_changes_nothing_is_refused(here, arguments, says):
    found = CliRunner().invoke(app, [a.replace("{filter}", here) for a in arguments])
    assert isinstance(found.exception, AscentwindError), found.output
    assert says in str(found.exception)


def test_every_option_was_looked_at():
    def options(command) -> set[str]:
        return {p.name for p in command.params if p.param_type_name == "option"} - {"help", *FRAME}

    found, whole = {}, typer.main.get_command(app)
    assert isinstance(whole, TyperGroup)
    for name, command in whole.commands.items():
        if isinstance(command, TyperGroup):
            found |= {f"{name} {inner}": options(c) for inner, c in command.commands.items()}
        else:
            found[name] = options(command)
    assert found == KNOWN
