"""All that differs by operating system: who ports the library begins here.

threads.py      how many threads; a range on a pool of them
locks.py        locks whose wait cannot be interrupted
forks.py        what is to be done where a process forks
memory.py       how much there is
settings.py     whole numbers that a user sets for the process
ownership.py    whose a file is, who else can write it, where caches are
renaming.py     names that change in one step
signals.py      a start that may be interrupted, an end that cleans up
"""
