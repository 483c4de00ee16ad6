"""Statistics of sweeps, and results as pictures and labelled arrays."""

from __future__ import annotations

import csv
import math
import statistics as standard
import subprocess
from pathlib import Path

import numpy as np
import pytest
from conftest import PLATE

import bimorph

NET = bimorph.Netlist.text(PLATE, "plate.net")
HERTZ = math.sqrt(1.0 / 1e-10) / math.tau
"""Of the plate at 1 N/m: (k/m)^½/2π [Hz]."""


def table(values: list[float | None], unit: str = "Hz") -> bimorph.Table:
    """A table with these results, of which some are not there."""
    rows = [
        bimorph.Row(k, {"k": float(k)}, {} if value is None else {"f1": value}, "no result" if value is None else "") for k, value in enumerate(values)
    ]
    return bimorph.Table(["k"], ["f1"], {"f1": unit}, rows)


def test_moments_and_percentiles() -> None:
    """Those of Python's own `statistics`: quantiles by the inclusive method are the percentiles of type 7."""
    values = [3.0, 1.0, 4.0, 1.5, 9.0, 2.6, 5.0]
    found = table([*values, None]).statistics(percentiles=[0, 25, 50, 75, 100])
    one = found.columns["f1"]
    assert (one.count, one.missing, one.minimum, one.maximum, one.unit) == (7, 1, 1.0, 9.0, "Hz")
    assert one.mean == pytest.approx(standard.mean(values), rel=1e-15) and one.deviation == pytest.approx(standard.stdev(values), rel=1e-15)
    quartiles = standard.quantiles(values, n=4, method="inclusive")
    assert list(one.percentiles.values()) == pytest.approx([1.0, *quartiles, 9.0], rel=1e-15)
    assert (found.passed.passed, found.passed.points) == (7, 8)
    assert math.isnan(table([2.0]).statistics().columns["f1"].deviation)
    assert math.isnan(table([None]).statistics().columns["f1"].mean)


def test_points_without_a_number_are_left_out_and_counted() -> None:
    """A missing result and NaN are in `missing`, in no moment, percentile or histogram, and outside of limits on either side."""
    found = table([1.0, None, 3.0, math.nan]).statistics(["f1>0", "f1<10"])
    one = found.columns["f1"]
    assert (one.count, one.missing, one.mean, one.minimum, one.maximum, one.percentiles[50.0]) == (2, 2, 2.0, 1.0, 3.0, 2.0)
    assert [fraction.passed for _, fraction in found.limits] == [2, 2] and found.passed.passed == 2
    assert table([1.0, None, 3.0, math.nan]).histogram("f1").counts.sum() == 2
    assert repr(found) == "<SweepStatistics of f1: 4 points, 2 of them without a result, yield 50.00% (15.00% to 85.00%)>"
    assert "<th>without</th>" in found._repr_html_()


def test_undecided_points_are_shown() -> None:
    """A result of 5 ± 1 % is undecided at a limit of 5.04, one of 6 ± 1 % is not; the number is in the text and the table, and 0 is not shown."""
    rows = [bimorph.Row(k, {}, {"f1": value}, "", error) for k, (value, error) in enumerate([(5.0, 0.01), (6.0, 0.01), (5.0, None)])]
    several = bimorph.Table([], ["f1"], {"f1": "Hz"}, rows)
    found = several.statistics("f1>5.04")
    assert found.undecided == 1 and found.passed.passed == 1
    for text in (repr(found), found._repr_html_()):
        assert "1 closer to a limit than their estimated error" in text
    assert several.statistics("f1>1").undecided == 0 and "closer" not in repr(several.statistics("f1>1"))


def test_yield() -> None:
    """Limits are open or closed as written, with the suffixes of netlists; a point without a result is beyond each. The interval of 8 in 10 is that of
    Wilson's formula: 0.4901625 to 0.9433178."""
    found = table([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, None, 10.0]).statistics(["f1>=1", "f1 < 10"])
    assert [(str(limit), fraction.passed) for limit, fraction in found.limits] == [("f1 >= 1", 9), ("f1 < 10", 8)]
    assert found.passed.value == 0.8
    assert found.passed.interval == pytest.approx((0.4901625, 0.9433178), abs=1e-7)
    assert found.passed.passed == 8 and "yield 80.00%" in found._repr_html_()
    assert table([0.0, 1.0]).statistics("k<=0").passed.passed == 1
    for written, value in [("y>-1.1u", -1.1e-6), ("f<90k", 9e4), ("f<90M", 9e7), ("f<90m", 9e-2), ("f<1meg", 1e6), ("f<1MEG", 1e6), ("a<2a", 2e-18), ("f<=2.5e3", 2500.0), ("q>-.5p", -5e-13), ("x<3m", 3e-3)]:
        name, limit = written[0], bimorph.Table(["k"], [written[0]], {written[0]: "1"}, []).statistics(written).limits[0][0]
        assert (limit.name, limit.value) == (name, value)
    for written in ("f1", "f1>", ">3", "f1=3", "f1>3x", "f1>3K", "f1>3U", "f1>nan", "f1>1e400", "f1>1e308k", "f1>1e" + "9" * 5000, ",,", "f1>1,,"):
        with pytest.raises(bimorph.InvalidRequest, match="limits.0.: expected a limit"):
            table([1.0]).statistics(written)
    with pytest.raises(bimorph.InvalidRequest, match="limits: expected the name of a column, got 'f2'; there are k, f1"):
        table([1.0]).statistics("f2>0")


def test_histogram() -> None:
    """Values on an inner edge are in the bin above; points without a result are in none."""
    found = table([0.0, 1.0, 1.0, 2.0, 4.0, None]).histogram("f1", bins=4)
    assert found.counts.tolist() == [1, 2, 1, 1] and found.edges.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0] and found.unit == "Hz"
    assert table([None]).histogram("f1").counts.sum() == 0


def test_histograms_of_nearly_equal_values() -> None:
    """Values that differ by a few roundings have as many bins as there are numbers between them; more bins are rejected by name, and so is an
    unknown column. Equal values are in one bin about them, and "auto" has the bins of numpy."""
    near = [1.0 + k * 2.0**-52 for k in range(9)]
    found = table([float(x) for x in near]).histogram("f1")
    assert found.counts.sum() == 9 and (np.diff(found.edges) > 0.0).all()
    with pytest.raises(bimorph.InvalidRequest, match="bins: expected at most 4 bins, as the values of 'f1' differ by 1.78e-15 only, got 1000"):
        table([float(x) for x in near]).histogram("f1", bins=1000)
    for value in (2.1e-8, 0.0, -3e17, 1e308):
        equal = table([value] * 3).histogram("f1")
        assert equal.counts.tolist() == [3] and equal.edges[0] < value < equal.edges[1]
    values = np.random.default_rng(3).normal(size=500)
    assert table(values.tolist()).histogram("f1").edges.tolist() == np.histogram(values, "auto")[1].tolist()
    assert len(table([*values.tolist(), 1e12]).histogram("f1").counts) == 100_000
    with pytest.raises(bimorph.InvalidRequest, match="name: expected a column with a finite range, got 'f1' from -1.7e[+]308"):
        table([-1.7e308, 1.7e308]).histogram("f1")
    for call in (lambda: table([1.0]).histogram("f2"), lambda: table([1.0]).column("f2")):
        with pytest.raises(ValueError, match="^name: expected the name of a column, got 'f2'; there are k, f1$") as caught:
            call()
        assert isinstance(caught.value, KeyError)


def test_samples_of_a_sweep(client: bimorph.Client) -> None:
    """A stiffness of 1 ± 0.1 N/m gives f = (k/m)^½/2π: mean and deviation of the sampled frequency are those of the sampled stiffness, and the yield of
    a limit at its median is a half: a Latin hypercube has half of its samples on each side."""
    spread = bimorph.Samples({"k": bimorph.Normal(1.0, 0.1)}, count=200, seed=3)
    found = client.sweep(NET, {}, bimorph.Modes(1), samples=spread)
    expected = [HERTZ * math.sqrt(k) for k in found.column("k")]  # type: ignore[arg-type]
    result = found.statistics([f"f1>{HERTZ!r}"])
    assert result.columns["f1"].mean == pytest.approx(standard.mean(expected), rel=1e-9)
    assert result.columns["f1"].deviation == pytest.approx(standard.stdev(expected), rel=1e-6)
    assert result.passed.passed == 100


def test_labelled_arrays(client: bimorph.Client, plate: bimorph.Model) -> None:
    """Every result has its units, as arrays of xarray and in pandas; a full grid has an axis for each parameter, samples have points."""
    pytest.importorskip("xarray")
    pytest.importorskip("pandas")
    run = plate.transient(1e-6, ["m.x"], points=5, voltages={"drive": 1.0})
    labelled = run.to_xarray()
    assert labelled["m.x"].attrs["units"] == "m" and labelled.t.attrs["units"] == "s" and labelled["m.x"].values.tolist() == run.signals["m.x"].tolist()
    assert run.to_pandas().attrs["units"] == {"t": "s", "m.x": "m"}
    response = plate.ac("m.fx", ["m.x"], start=1e3, stop=2e3, points=3, even=True)
    assert response.to_xarray()["m.x"].dtype == np.complex128 and response.to_xarray()["m.x"].attrs["units"] == response.units["m.x"]
    modes = plate.modes(1).to_xarray()
    assert float(modes.x.sel(mode=1, node="m")) == pytest.approx(1.0, rel=1e-12) and modes.frequency_hz.attrs["units"] == "Hz"
    assert plate.static({"drive": 1.0}).to_xarray().x.sel(node="m") > 0.0
    assert plate.pull_in().to_xarray().pull_in_v.attrs["units"] == "V" and plate.pull_in().to_pandas().loc["drive", "pull_in_v"] > 5.0
    grid = client.sweep(NET, {"k": [1.0, 4.0], "drive.v": [0.0, 1.0, 2.0]}, bimorph.Modes(1))
    array = grid.to_xarray()["f1"]
    assert array.dims == ("k", "drive.v") and array.shape == (2, 3) and array.attrs["units"] == "Hz"
    assert array.values.ravel().tolist() == grid.column("f1")
    assert grid.to_pandas().attrs["units"]["f1"] == "Hz"
    spread = bimorph.Samples({"k": bimorph.Uniform(1.0, 2.0), "V": bimorph.Uniform(0.0, 1.0)}, 5)
    samples = client.sweep(NET, {}, bimorph.Modes(1), samples=spread)
    assert samples.to_xarray()["f1"].dims == ("point",) and samples.to_xarray().k.values.tolist() == samples.column("k")


def test_pictures(client: bimorph.Client, plate: bimorph.Model) -> None:
    """Every result draws itself: what is on the axes is what is in the result."""
    pytest.importorskip("matplotlib").use("Agg")
    from matplotlib import pyplot

    static = plate.static({"drive": 1.0})
    assert static.plot().get_lines()[0].get_ydata()[list(static.nodes).index("m")] == static.nodes["m"].x
    modes = plate.modes(1)
    assert modes.plot().get_ylabel() == "f [Hz]"
    pull_in = plate.pull_in()
    assert pull_in.plot().get_lines()[0].get_xdata()[1] == pull_in.pull_in_v
    assert plate.ac("m.fx", ["m.x"], start=1e3, stop=2e3, points=3).plot().get_xlabel() == "f [Hz]"
    grid = client.sweep(NET, {"k": [1.0, 4.0], "drive.v": [0.0, 1.0, 2.0]}, bimorph.Modes(1))
    lines = grid.plot().get_lines()
    assert [line.get_ydata().tolist() for line in lines] == [grid.column("f1")[:3], grid.column("f1")[3:]]
    assert [line.get_label() for line in lines] == ["k = 1", "k = 4"]
    samples = client.sweep(NET, {}, bimorph.Modes(1), samples=bimorph.Samples({"k": bimorph.Uniform(1.0, 2.0)}, 50))
    drawn = samples.plot("f1")
    assert drawn.get_ylabel() == "points" and drawn.get_xlabel() == "f1 [Hz]"
    pyplot.close("all")

def test_parquet_of_the_command(program: str, tmp_path: Path) -> None:
    """The Parquet file of `bimorph sweep` has the numbers of its CSV to the bit, its texts, and nulls where a point has no result, as another
    program reads them; more columns than a short list of Thrift has, and rows of more than one group."""
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    (tmp_path / "plate.net").write_text(PLATE)
    words = ["--param", "k=0.1,1,2.5", "--analysis", "pullin", "--max", "4", "--out", "t.csv", "--out", "t.parquet"]
    subprocess.run([program, "sweep", "plate.net", *words], cwd=tmp_path, check=True, capture_output=True)
    table = parquet.read_table(tmp_path / "t.parquet")
    rows = list(csv.DictReader((tmp_path / "t.csv").open(newline="")))
    assert table.schema.field("point").type == pyarrow.int64() and table.schema.field("error").type == pyarrow.string()
    assert table.schema.field("pull_in [V]").type == pyarrow.float64()
    found = table.to_pylist()
    assert list(found[0]) == list(rows[0])
    for one, row in zip(found, rows, strict=True):
        for name, text in row.items():
            value = one[name]
            assert value == (text if isinstance(value, str) else None if text == "" else float(text)), name
    assert [one["pull_in [V]"] is None for one in found] == [False, True, True] and found[1]["error"]
    words = ["--param", "k=1:2:70000", "--param", "V=0,one", "--analysis", "modes", "--count", "1", "--out", "m.parquet"]
    subprocess.run([program, "sweep", "plate.net", *words], cwd=tmp_path, check=True, capture_output=True)
    file = parquet.ParquetFile(tmp_path / "m.parquet")
    assert (file.metadata.num_rows, file.metadata.num_row_groups) == (140_000, 3)
    read = file.read()
    assert read.column("point").to_pylist() == list(range(140_000))
    assert read.column("V").to_pylist()[:2] == ["0e0", "one"]
    assert read.column("f1 [Hz]").null_count == 0
