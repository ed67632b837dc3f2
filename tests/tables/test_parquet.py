"""Parquet files: row groups, compression and encodings are those of the input."""

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from collide._tables import parquet_files
from tests.helpers.tables import FOREIGN, LINE, N, assert_refused, read, resolve, write

pytestmark = pytest.mark.usefixtures("small_blocks")


def row_groups(path):
    metadata = pq.read_metadata(path)
    return [metadata.row_group(g) for g in range(metadata.num_row_groups)]


@pytest.mark.parametrize("size", [70, 300, 400, N, 5 * N])
def test_row_groups_are_those_of_the_input(size, tmp_path):
    """Whether they have fewer rows than a block, as many, or more."""
    source = write(tmp_path / "a.parquet", LINE, row_group_size=size)
    assert resolve(source, tmp_path / "b.parquet") == 0
    sizes = [[group.num_rows for group in row_groups(path)] for path in (source, tmp_path / "b.parquet")]
    assert sizes[0] == sizes[1]


def test_what_is_too_large_becomes_several_row_groups(tmp_path, monkeypatch):
    """Each of whole blocks, so that memory does not grow with the row groups of the input."""
    monkeypatch.setattr(parquet_files, "GROUP_BYTES", 20_000)  # where a row has 48
    source = write(tmp_path / "a.parquet", LINE, row_group_size=N)
    assert resolve(source, tmp_path / "b.parquet") == 0
    assert [group.num_rows for group in row_groups(tmp_path / "b.parquet")] == [600, 400]
    assert read(tmp_path / "b.parquet").select(list(LINE)).equals(read(source))


def test_parquet_keeps_compression_and_encodings(tmp_path):
    table = pa.table({**LINE, "name": FOREIGN["name"], "tags": FOREIGN["tags"]})
    codecs = {"m1": "zstd", "m2": "snappy", "v1": "none", "v2": "gzip", "name": "lz4", "tags.list.element": "zstd"}
    write(tmp_path / "a.parquet", table, compression=codecs, use_dictionary=["name"])
    assert resolve(tmp_path / "a.parquet", tmp_path / "b.parquet") == 0
    before, after = (pq.ParquetFile(tmp_path / f"{name}.parquet").metadata.row_group(0) for name in "ab")
    for c in range(before.num_columns):
        assert before.column(c).compression == after.column(c).compression
        assert ("PLAIN" in before.column(c).encodings) == ("PLAIN" in after.column(c).encodings)
        assert before.column(c).has_dictionary_page == after.column(c).has_dictionary_page
    assert after.column(before.num_columns).compression == "ZSTD"  # as m1
    assert not after.column(before.num_columns).has_dictionary_page


def test_nested_parts_keep_their_names_and_codecs(tmp_path):
    table = pa.table({**LINE, "tags": FOREIGN["tags"].cast(pa.list_(pa.field("item", pa.int64())))})
    options = {"use_compliant_nested_type": False, "compression": {"m1": "none", "tags.list.item": "zstd"}}
    source = write(tmp_path / "a.parquet", table, **options)
    assert resolve(source, tmp_path / "b.parquet") == 0
    assert pq.read_schema(tmp_path / "b.parquet").field("tags").type.equals(table.schema.field("tags").type)
    assert pq.ParquetFile(tmp_path / "b.parquet").metadata.row_group(0).column(4).compression == "ZSTD"


def test_a_dictionary_is_kept_where_it_saves_something(tmp_path):
    """Of numbers that are all different, the writer of the input has given it up, and so would that of the output."""
    table = pa.table({**LINE, "m2": np.tile([1.0, 2.0], N // 2), "name": FOREIGN["name"], "kind": FOREIGN["kind"]})
    source = write(tmp_path / "a.parquet", table, row_group_size=N)
    assert resolve(source, tmp_path / "b.parquet") == 0
    (before,), (after,) = row_groups(source), row_groups(tmp_path / "b.parquet")
    columns = [(before.column(c), after.column(c)) for c in range(before.num_columns)]
    assert all(b.has_dictionary_page for b, _ in columns)
    assert [a.has_dictionary_page for _, a in columns] == [False, True, False, False, True, True]
    assert all(a.total_uncompressed_size < b.total_uncompressed_size for b, a in columns if not a.has_dictionary_page)
    assert read(tmp_path / "b.parquet").select(table.column_names).equals(read(source))


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (OSError(28, "No space left on device"), "b.parquet: No space left on device"),
        (pa.ArrowInvalid("Of a bad length."), "row {}: cannot be read, or not be written (Of a bad length)"),
    ],
    ids=["disk", "data"],
)
@pytest.mark.parametrize("n", [0, 2])
def test_an_error_where_a_row_group_is_written(n, error, words, tmp_path, monkeypatch, capsys):
    """In the first one or in the last, of which a thread of its own learns."""
    source, target = write(tmp_path / "a.parquet", LINE), tmp_path / "out" / "b.parquet"
    target.parent.mkdir()
    written, write_table = [], pq.ParquetWriter.write_table

    def failing(writer, table, *rest):
        written.append(table.num_rows)
        if len(written) > n:
            raise error
        write_table(writer, table, *rest)

    monkeypatch.setattr(pq.ParquetWriter, "write_table", failing)
    assert resolve(source, target) == 1
    assert_refused(capsys, target, words.format(400 * n))
    assert written == [400, 400, 200][: n + 1]
