"""Tables, which are columns by name, of any size.

by_name.py          which columns are meant
stream.py           the way of a table: read, resolved, written at the same time, block by block
numpy_files.py, parquet_files.py, ipc_files.py, csv_files.py    the formats; collide/__main__.py lists them by suffix
arrow_files.py      what the formats of pyarrow share
arrow_batches.py    what Arrow's files share with collide.arrow
replacement.py      a file is replaced whole, or not at all
conservation.py     by how much momentum and energy have changed
"""
