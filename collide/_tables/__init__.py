"""Columns by name: which are meant, files of every format block by block, replaced whole, and what is conserved."""
