"""Tables of sweeps: shards put together, and what columns are called."""

from __future__ import annotations

import dataclasses
import pathlib
from pathlib import Path

import pytest
from conftest import PLATE

import bimorph
from bimorph.executors import together

CHAIN = """param n=1
process p = [Youngsmodulus=165e9 density=2300 h=2u]
anchor p [a(0)] [l=5u w=5u]
for k=1:n
[
  beam2d p [a(k-1) a(k)] [l=50u w=2u]
]
"""
"""A chain of beams whose nodes depend on ``n``."""


def test_shards_with_other_columns(client: bimorph.Client) -> None:
    """Where the nodes depend on a parameter, the shards put together are the sweep in one run, whatever columns each of them has."""
    netlist = bimorph.Netlist.text(CHAIN)
    for lengths in ([1.0, 2.0, 3.0, 4.0, 5.0], [3.0, 1.0, 5.0, 2.0, 4.0]):
        whole = client.sweep(netlist, {"n": lengths}, bimorph.Static())
        parts = [client.sweep(netlist, {"n": lengths}, bimorph.Static(), shard=(i, 3)) for i in range(3)]
        assert len({tuple(part.results) for part in parts}) > 1
        assert together(parts) == together(parts[::-1]) == whole


def test_tables_of_different_sweeps_are_refused(client: bimorph.Client) -> None:
    """Other parameters, another unit of one column, and a point that is there twice."""
    netlist = bimorph.Netlist.text(CHAIN)
    part, other = (client.sweep(netlist, {"n": [1.0, 2.0]}, bimorph.Static(), shard=(i, 2)) for i in range(2))
    for wrong in (
        dataclasses.replace(other, parameters=["m"]),
        dataclasses.replace(other, units={**other.units, part.results[0]: "rad" if part.units[part.results[0]] != "rad" else "m"}),
    ):
        with pytest.raises(bimorph.BimorphError, match="not the shards of one sweep"):
            together([part, wrong])
    with pytest.raises(bimorph.BimorphError, match="point 0 is in two shards"):
        together([part, other, part])


def test_a_parameter_with_the_name_of_a_result(client: bimorph.Client) -> None:
    """Neither hides the other: the result is called with its unit, as in CSV. A parameter that no table could show is reported."""
    netlist = bimorph.Netlist.text(CHAIN.replace("w=2u", "w=f1").replace("param n=1", "param n=1\nparam f1=2u"))
    widths = [1e-6, 2e-6]
    table = client.sweep(netlist, {"f1": widths}, bimorph.Modes(count=1))
    found = [row.results["f1"] for row in table.rows]
    assert found == pytest.approx([found[0], 2 * found[0]], rel=1e-3), "a cantilever's frequency goes with its width"
    assert table.column("f1 [Hz]") == found
    with pytest.raises(KeyError, match="'f1 \\[Hz\\]'"):
        table.column("f1")
    frame = table.to_pandas() if pytest.importorskip("pandas") else None
    assert frame is not None and list(frame["f1"]) == widths and list(frame["f1 [Hz]"]) == found
    hidden = dataclasses.replace(table, parameters=["error"])
    with pytest.raises(ValueError, match="'error'"):
        hidden.to_pandas()


def test_a_table_goes_to_parquet_and_back(client: bimorph.Client, tmp_path: pathlib.Path) -> None:
    """With its numbers bit by bit, its units, and nothing where a point has none; an axis of a port's voltage is a column like others."""
    pytest.importorskip("pyarrow")
    from pyarrow import parquet

    netlist = bimorph.Netlist.text(PLATE)
    table = client.sweep(netlist, {"k": [1.0, 2.0], "drive.v": [0.0, 1.0, 1e3]}, bimorph.Static(outputs=["m.x"]))
    parquet.write_table(table.to_arrow(), tmp_path / "t.parquet")
    back = parquet.read_table(tmp_path / "t.parquet")
    assert back.column_names == ["point", "k", "drive.v", "m.x", "estimated_error", "warning", "error"]
    assert back.column("m.x").to_pylist() == [row.results.get("m.x") for row in table.rows]
    assert back.column("drive.v").to_pylist() == [0.0, 1.0, 1e3] * 2
    assert back.schema.field("m.x").metadata == {b"unit": b"m"} and back.schema.metadata[b"parameters"] == b"2"
    empty = bimorph.Table(table.parameters, table.results, table.units, [])
    assert empty.to_arrow().schema.equals(table.to_arrow().schema, check_metadata=True)
    moved = table.column("m.x")
    assert moved[0] == 0.0 and moved[1] != 0.0 and moved[4] == pytest.approx(moved[1] / 2, rel=1e-2)
    with pytest.raises(bimorph.BimorphError, match="W.v"):
        client.sweep(netlist, {"W.v": [0.0]}, bimorph.Static(outputs=["m.x"]))


def test_points_that_go_together_and_options(client: bimorph.Client) -> None:
    """Names in a tuple are a list of points, which is an axis like any other; options vary as parameters do, flags as True and False."""
    netlist = bimorph.Netlist.text(PLATE)
    held = bimorph.Static(outputs=["m.x"])
    corners = {("k", "drive.v"): [(1.0, 0.0), (2.0, 3.0)], "option.tol": [1e-2, 1e-4]}
    table = client.sweep(netlist, corners, held)
    assert table.parameters == ["k", "drive.v", "option.tol"]
    assert [tuple(row.parameters.values()) for row in table.rows] == [
        (1.0, 0.0, 1e-2),
        (1.0, 0.0, 1e-4),
        (2.0, 3.0, 1e-2),
        (2.0, 3.0, 1e-4),
    ]
    alone = client.sweep(netlist, {"k": [2.0]}, bimorph.Static(outputs=["m.x"], voltages={"drive": 3.0}), tol=1e-4)
    assert table.rows[3].results == alone.rows[0].results
    flags = client.sweep(netlist, {"option.linear": [True, False], "k": [1.0]}, held)
    assert flags.column("option.linear") == ["true", "false"]
    with pytest.raises(ValueError, match="2 names"):
        client.sweep(netlist, {("k", "drive.v"): [(1.0,)]}, held)
    with pytest.raises(bimorph.BimorphError, match="one of tol, band"):
        client.sweep(netlist, {"option.tool": [1.0]}, held)


def test_tables_on_file_systems(client: bimorph.Client, tmp_path: Path) -> None:
    """A Parquet file is read back with its rows and units, from a path, a URI, a part of a file system, and a store in memory; where it cannot be
    written, nothing is left."""
    pytest.importorskip("pyarrow")
    from pyarrow import fs, parquet

    table = client.sweep(bimorph.Netlist.text(PLATE, "plate.net"), {"k": [1.0, 4.0]}, bimorph.Modes(1))
    memory = fs._MockFileSystem()
    memory.create_dir("bucket")
    places = [
        (tmp_path / "a.parquet", None, fs.LocalFileSystem(), str(tmp_path / "a.parquet")),
        ((tmp_path / "b.parquet").as_uri(), None, fs.LocalFileSystem(), str(tmp_path / "b.parquet")),
        ("c.parquet", fs.SubTreeFileSystem(str(tmp_path), fs.LocalFileSystem()), fs.LocalFileSystem(), str(tmp_path / "c.parquet")),
        ("bucket/d.parquet", memory, memory, "bucket/d.parquet"),
    ]
    for path, given, store, place in places:
        table.to_parquet(path, filesystem=given)
        read = parquet.read_table(place, filesystem=store)
        assert read.column("f1").to_pylist() == table.column("f1") and read.equals(table.to_arrow())
        assert read.schema.field("f1").metadata == {b"unit": b"Hz"}
    with pytest.raises(OSError, match="nosuch"):
        table.to_parquet(tmp_path / "nosuch" / "e.parquet")
    with pytest.raises(bimorph.InvalidRequest, match="path: expected .*nosuch://"):
        table.to_parquet("nosuch://bucket/f.parquet")
    assert sorted(file.name for file in tmp_path.iterdir()) == ["a.parquet", "b.parquet", "c.parquet"]
