"""Tables, which are columns by name, of any size.

by_name.py          which columns are meant
missing.py          what is said where they are not there
stream.py           the way of a table: read, resolved, written at the same time, block by block
formats.py          the table of formats: an entry each
npy_folders.py, npz_files.py, parquet_files.py, ipc_files.py, csv_files.py    what reads and writes them
numpy_files.py      what the formats of NumPy share
arrow_files.py      what the formats of pyarrow share
conversion.py       columns of NumPy's as Arrow holds them, and the other way round
standard.py         standard input and output
arrow_batches.py    what Arrow's files share with collide.arrow
replacement.py      a file is replaced whole, or not at all
conservation.py     by how much momentum and energy have changed
"""
