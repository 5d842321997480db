"""The page of a results folder: its numbers, what it names as missing, what it refuses; it asks for nothing."""

from __future__ import annotations

import json
import math
import re
import sys
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from lag import GAIN, INPUT, TAU, lag
from scipy.io import savemat

from ascentwind.errors import DataError, MissingLibraryError, OutputFolderError, ResultsFolderError
from ascentwind.model.vehicle.shipped import find_vehicle
from ascentwind.runners.cli.app import main
from ascentwind.runners.present.manifest import MANIFEST, Manifest
from ascentwind.runners.report import library
from ascentwind.runners.report.folder import open_folder
from ascentwind.runners.report.page import page_of

pytest.importorskip("bokeh")
pytest.importorskip("markdown_it")

TIMES = [1.0, 2.0, 4.0]


class Reader(HTMLParser):
    """What stands on a page: cells by row, sections, and every address that an attribute names."""

    def __init__(self, text: str):
        super().__init__()
        self.rows: list[list[str]] = []
        self.tags: list[str] = []
        self.sections: list[str] = []
        self.addresses: list[str] = []
        self.inside = ""
        self.text = ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.tags.append(tag)
        self.inside = tag
        if tag == "tr":
            self.rows.append([])
        elif tag in ("td", "th") and self.rows:
            self.rows[-1].append("")
        elif tag == "section":
            self.sections.append(given["id"] or "")
        self.addresses += [given[name] or "" for name in ("src", "href", "action", "poster", "data") if name in given]

    def handle_data(self, data):
        if self.inside in ("td", "th") and self.rows and self.rows[-1]:
            self.rows[-1][-1] += data.strip()
        if self.inside not in ("script", "style"):
            self.text += data


def run_folder(folder: Path, times=TIMES, about=None, of="lag") -> Path:
    """Write what ``run`` writes, without its figures."""
    statistics = lag().response_statistics(times)
    about = {"title": "A lag", "typed": "ascentwind run lag"} if about is None else about
    manifest = Manifest.begin(folder, "run", of, about)
    manifest.finish(statistics.save(folder))
    return folder


@pytest.fixture
def folder(tmp_path) -> Path:
    (tmp_path / "found").mkdir()
    return run_folder(tmp_path / "found")


def test_peaks_are_the_closed_form_s(folder):
    time = TIMES[-1]
    sigma = math.sqrt(GAIN**2 * TAU / 2 * (1 - math.exp(-2 * time / TAU)))
    mean = GAIN * INPUT * TAU * (1 - math.exp(-time / TAU))
    row = next(r for r in Reader(page_of(folder).html()).rows if r[0] == "x")
    assert row[:4] == ["x", f"{mean + 3 * sigma:.4g}", "4 s*", "mean + 3σ"]
    assert row[4:6] == [f"{mean:.4g}", f"{sigma:.4g}"]


def test_curves_hold_the_numbers_of_the_file(folder):
    from bokeh.document import Document
    from bokeh.models import ColumnDataSource

    data = re.search(r'<script type="application/json" id="figures">(.*?)</script>', page_of(folder).html(), re.S)
    assert data is not None
    documents = [Document.from_json(item["doc"]) for item in json.loads(data[1])]
    found = [s for d in documents for root in d.roots for s in root.select({"type": ColumnDataSource})]
    sources = [s for s in found if isinstance(s, ColumnDataSource)]
    arrays = [np.asarray(s.data["y"]) for s in sources if "y" in s.column_names]
    statistics = lag().response_statistics(TIMES)
    wanted = (statistics.mean - 3 * statistics.std).sel(source="combined", response="x").values
    assert any(a.shape == wanted.shape and np.allclose(a, wanted, rtol=1e-12) for a in arrays)


def test_nothing_is_asked_for(folder):
    html = page_of(folder).html()
    read = Reader(html)
    assert read.addresses
    assert [a for a in read.addresses if not a.startswith(("#", "data:"))] == []
    assert "default-src 'none'" in html
    scripts = re.findall(r"<script>(.*?)</script>", html, re.S)
    assert sum(map(len, scripts)) < 1.5e6
    assert len(html.encode()) < 5e6
    assert "url(http" not in html and "@import" not in html.split("</style>")[0]


def test_landmarks_and_anchors(folder):
    html = page_of(folder).html()
    read = Reader(html)
    for tag in ("header", "nav", "main", "footer", "h1"):
        assert read.tags.count(tag) == 1, tag
    assert {a[1:] for a in read.addresses if a.startswith("#")} <= {*read.sections, "content"}
    assert 'lang="en"' in html
    assert all("alt=" in image for image in re.findall(r"<img [^>]*>", html))


def test_names_that_are_markup_stay_text(tmp_path):
    hostile = "</script><img src=x onerror=alert(1)> $$x$$ @y"
    run_folder(tmp_path, about={"title": hostile, "typed": hostile, "warnings": [hostile], "notes": [hostile]})
    read = Reader(page_of(tmp_path).html())
    assert "img" not in read.tags
    assert hostile in read.text


def test_what_is_missing_is_named_with_its_command(tmp_path):
    run_folder(tmp_path, about={"title": "A lag", "tables": [{"file": "a.csv", "status": "found", "source": "a book",
                                                              "first": 0.0, "last": 9.0}]})  # fmt: skip
    text = Reader(page_of(tmp_path).html()).text
    for command in ("flight-load lag --out", "sensitivity lag --out", "flight-load lag --limit FILE --out"):
        assert f"ascentwind {command} {tmp_path}" in text
    assert "a book" in text


def test_a_figure_that_is_gone_or_not_of_the_run_is_named(folder):
    statistics = lag().response_statistics(TIMES)
    manifest = Manifest.begin(folder, "run", "lag", {"title": "A lag"})
    from ascentwind.runners.present.style import write_figure

    written = [*statistics.save(folder), *write_figure(statistics.plot("x"), folder, "another")]
    manifest.finish(written)
    assert len(re.findall("<img ", page_of(folder).html())) == 1
    (folder / "another.png").unlink()
    (folder / "stranger.csv").write_text("a,b\n1,2\n")
    text = Reader(page_of(folder).html()).text
    assert "gone or changed since: another.png" in text
    assert "of none of these runs, so not shown: stranger.csv" in text


def test_a_verdict_is_said_or_said_to_be_missing(folder):
    assert "stand unchecked" in Reader(page_of(folder).html()).text
    from ascentwind.runners.statistics.peak_check import check_peaks, with_peak_check

    study = lag()
    statistics = study.response_statistics(TIMES)
    check = check_peaks(study, statistics)
    manifest = Manifest.begin(folder, "run", "lag", {"title": "A lag"})
    manifest.finish(with_peak_check(statistics, check, study).save(folder))
    text = Reader(page_of(folder).html()).text
    assert check.verdict() in text
    assert "stand unchecked" not in text


def test_other_folders_have_pages_of_their_tables_and_texts(tmp_path):
    table, page = tmp_path / "design.csv", tmp_path / "day_of_launch.md"
    table.write_text("kind,name,before\nparameter,gain,1.25\n" + "parameter,other,2\n" * 99)
    page.write_text("# NO-GO: A lag\n\n- Chance **0.2** <b>of</b> it\n\n![figure](day_of_launch.png)\n")
    Manifest.begin(tmp_path, "design", "lag").finish([table])
    Manifest.begin(tmp_path, "day-of-launch", "lag").finish([page])
    html = page_of(tmp_path).html()
    read = Reader(html)
    assert ["parameter", "gain", "1.25"] in read.rows
    assert "40 more rows in design.csv" in read.text
    assert "<h3>NO-GO: A lag</h3>" in html and "<strong>0.2</strong>" in html
    assert "&lt;b&gt;of&lt;/b&gt;" in html
    assert "img" not in read.tags


def test_a_wind_filter_has_a_page(tmp_path):
    shipped = find_vehicle("as504") / "wind_march_zonal_filter.json"
    (tmp_path / "wind_filter.json").write_bytes(shipped.read_bytes())
    read = Reader(page_of(tmp_path).html())
    assert ["order", "3"] in read.rows
    assert "march zonal, Cape Canaveral, edition 1983" in read.text
    assert "Coefficients F" in read.text


def spoil_statistics(folder: Path) -> None:
    lag().response_statistics([3.0]).save(folder)


def another_vehicle(folder: Path) -> None:
    (folder / "gusts.csv").write_text("a\n1\n")
    Manifest.begin(folder, "gust", "falcon1").finish([folder / "gusts.csv"])


def other_numbers(folder: Path) -> None:
    found = lag().with_parameters({"tau": 3.0}).response_statistics(TIMES)
    path = found.save(folder / "other")[0]
    path.replace(folder / "limits.nc")
    Manifest.begin(folder, "flight-load", "lag").finish([folder / "limits.nc"])


def unfinished(folder: Path) -> None:
    Manifest.begin(folder, "run", "lag")


def torn(folder: Path) -> None:
    path = folder / "statistics.nc"
    path.write_bytes(path.read_bytes()[:200])
    Manifest.begin(folder, "run", "lag").finish([path])


def no_statistics(folder: Path) -> None:
    path = folder / "statistics.nc"
    path.write_bytes(b"CDF\x01" + bytes(28))
    Manifest.begin(folder, "run", "lag").finish([path])


def no_table(folder: Path) -> None:
    path = folder / "design.csv"
    path.write_text("a,b\n1\n")
    Manifest.begin(folder, "design", "lag").finish([path])


def no_picture(folder: Path) -> None:
    path = folder / "trade.png"
    path.write_bytes(b"\x89PNG\r\n")
    Manifest.begin(folder, "design", "lag").finish([path])


def foreign_manifest(folder: Path) -> None:
    (folder / MANIFEST).write_text('{"name": "a web application", "icons": []}')


def a_batch(folder: Path) -> None:
    found = lag().batch([{"tau": 1.0}, {"tau": 2.0}], TIMES)
    Manifest.begin(folder, "run", "lag").finish(found.save(folder))


BAD = [
    (spoil_statistics, "is not the file that 'ascentwind run' wrote there"),
    (another_vehicle, "'lag' .'ascentwind run'. and 'falcon1' .'ascentwind gust'.; one page is of one vehicle"),
    (other_numbers, "statistics.nc and limits.nc were computed from different numbers"),
    (unfinished, "'ascentwind run' did not end there"),
    (torn, "statistics.nc: cannot be read as NetCDF"),
    (no_statistics, "statistics.nc: (cannot be read|holds no response statistics)"),
    (no_table, "design.csv: is no table"),
    (no_picture, "trade.png: is no picture"),
    (foreign_manifest, "is no manifest of this program"),
    (a_batch, "is of a batch"),
]


@pytest.mark.parametrize(("spoil", "said"), BAD, ids=[spoil.__name__ for spoil, _ in BAD])
def test_what_does_not_belong_together_is_refused(folder, spoil, said):
    spoil(folder)
    with pytest.raises(DataError, match=said):
        page_of(folder)


def test_folders_that_are_none_are_refused(tmp_path):
    (tmp_path / "empty").mkdir()
    (tmp_path / "file").write_text("")
    for name, said in (("empty", "holds no results"), ("file", "is a file"), ("nowhere", "no such folder")):
        with pytest.raises(ResultsFolderError, match=said):
            open_folder(tmp_path / name)


def test_a_folder_without_manifest_is_shown_and_said_to_have_none(tmp_path):
    lag().response_statistics(TIMES).save(tmp_path)
    assert "no manifest" in Reader(page_of(tmp_path).html()).text


@pytest.fixture
def ascentwind(monkeypatch, capsys):
    def run(*arguments: object) -> tuple[int, str]:
        monkeypatch.setattr(sys, "argv", ["ascentwind", *map(str, arguments)])
        with pytest.raises(SystemExit) as stop:
            main()
        printed = capsys.readouterr()
        return int(stop.value.code or 0), re.sub(r"\s+", " ", printed.out + printed.err)

    return run


def test_the_command_writes_the_page_and_a_later_run_says_it_is_old(ascentwind, folder):
    code, said = ascentwind("report", folder)
    assert code == 0
    assert str(folder / "report.html") in said
    assert (folder / "report.html").read_text().startswith("<!doctype html>")
    assert json.loads((folder / MANIFEST).read_text())["report"]["complete"]
    manifest = Manifest.begin(folder, "run", "lag")
    told = manifest.finish(lag().response_statistics(TIMES).save(folder))
    assert any("'ascentwind report' writes it anew: report.html" in sentence for sentence in told)


def test_where_nothing_can_be_written_is_told(ascentwind, folder, tmp_path):
    (tmp_path / "file").write_text("")
    code, said = ascentwind("report", folder, "--out", tmp_path / "file" / "report.html")
    assert code == 2
    assert "results cannot be written to" in said
    assert issubclass(OutputFolderError, Exception)


def test_a_missing_library_is_told_before_anything_is_computed(ascentwind, monkeypatch, tmp_path):
    monkeypatch.setattr(library, "LIBRARIES", {"no_such_module_bokeh": "bokeh"})
    monkeypatch.chdir(tmp_path)
    with pytest.raises(MissingLibraryError, match=r"ascentwind\[report\]"):
        library.checked_libraries()
    code, said = ascentwind("run", "as504", "--report")
    assert code == 2
    assert "pip install" in said
    assert list(tmp_path.iterdir()) == []


def test_the_command_run_writes_the_page_of_a_system(ascentwind, tmp_path, monkeypatch, cache):
    monkeypatch.chdir(tmp_path)
    savemat("m.mat", {"time": [0.0, 10.0], "A": [[-0.5]], "B": [[3.0]], "C": [[1.0]]})
    Path("s.toml").write_text('name = "lag"\ndata = "m.mat"\n[names]\noutputs = ["x"]\n')
    code, said = ascentwind("run", "--system", "s.toml", "--times", "1,4", "--report")
    assert code == 0, said
    read = Reader((tmp_path / "lag-results" / "report.html").read_text(encoding="utf-8"))
    assert "ascentwind run --system s.toml --times 1,4 --report" in read.text
    row = next(r for r in read.rows if r[0] == "x")
    assert row[5] == f"{3 * math.sqrt(1 - math.exp(-4)):.4g}"
    assert "for one page of it" not in said  # it is written
