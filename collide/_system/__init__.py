"""All that differs by operating system: who ports the library begins here.

Which system it is, and what there is of what some have not got, is asked in this room only.

threads.py      how many threads; a range on a pool of them
locks.py        locks whose wait cannot be interrupted
forks.py        what is to be done where a process forks
processors.py   how many there are
memory.py       how much there is
settings.py     whole numbers that a user sets for the process
ownership.py    whose a file is, who else can read or write it, where caches are
renaming.py     which names there may be, and how they change in one step
disk.py         files that are on the disk
messages.py     what the system says of its errors
signals.py      a start that may be interrupted, an end that cleans up
"""
