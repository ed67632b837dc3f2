"""Batches of pairs: the forms and their loop over arrays, the checks of a call and its execution."""
